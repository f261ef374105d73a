"""What stays as it is, or decays as it should, whatever the method and the step."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators import INTEGRATORS

every_method = pytest.mark.parametrize('method', INTEGRATORS)


def scene(**changes: object) -> Scene:
    """No air, no drag, nothing pinned, structural springs only, double precision."""
    base = {
        'pins': [''],
        'drag': 0.0,
        'wind.air_density': 0.0,
        'springs.shear': 0.0,
        'springs.bending': 0.0,
        'solver.precision': 'double',
    }
    return Scene().with_parameters({**base, **changes})


@every_method
@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('substeps', [40, 200])
def test_a_falling_sheet_keeps_its_shape_to_rounding(precision, substeps, method):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 6,
                'sheet.columns': 7,
                'solver.method': method,
                'solver.precision': precision,
                'solver.substeps': substeps,
            }
        )
    )
    start = cloth.positions
    for _ in range(60):
        cloth.advance(1 / 60)
    n = 60 * substeps
    fall = 9.81 / 2
    eps = np.finfo(np.float32 if precision == 'single' else np.float64).eps
    error = np.abs(cloth.positions - start - (0, 0, -fall)).max()
    assert error < 5 * n * eps
    assert cloth.largest_strain() < (1e-9 if precision == 'double' else 2e-3)


@every_method
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), precision=st.sampled_from(['single', 'double']))
def test_momentum_is_kept_without_outer_forces(seed, precision, method):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 8,
                'sheet.columns': 9,
                'gravity': [0, 0, 0],
                'springs.shear': 100.0,
                'springs.bending': 20.0,
                'springs.damping': 0.01,
                'solver.method': method,
                'solver.precision': precision,
            }
        )
    )
    generator = np.random.default_rng(seed)
    cloth.positions = cloth.positions + generator.normal(0, 0.05, (8, 9, 3))
    cloth.velocities = generator.normal(0, 1, (8, 9, 3))
    p, v = cloth.positions, cloth.velocities
    cloth.advance(0.5)
    q, w = cloth.positions, cloth.velocities
    tight = 1e-12 if precision == 'double' else 1e-3
    np.testing.assert_allclose(w.mean((0, 1)), v.mean((0, 1)), atol=tight)
    np.testing.assert_allclose(q.mean((0, 1)) - p.mean((0, 1)), 0.5 * w.mean((0, 1)), atol=tight)
    if precision == 'double':
        # A kick along the springs and a drift along the velocities keep the angular momentum
        # about any point as well, and so does every method that is made of these.
        before, after = np.cross(p, v).sum((0, 1)), np.cross(q, w).sum((0, 1))
        np.testing.assert_allclose(after, before, atol=1e-9 * np.abs(np.cross(p, v)).sum())


@every_method
def test_energy_stays_without_damping(method):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 10,
                'sheet.columns': 10,
                'pins': ['0,0', '0,-1'],
                'springs.shear': 250.0,
                'springs.bending': 50.0,
                'solver.method': method,
            }
        )
    )
    start = cloth.energy()
    swing = 0.2 * 9.81 * 1.0  # J, what the fall of the sheet by its length turns over
    for _ in range(20):
        cloth.advance(1.0)
        assert abs(cloth.energy() - start) < 0.002 * swing


@every_method
@pytest.mark.parametrize('ticks', [30, 60, 240])
def test_velocity_decays_at_the_rate_given(ticks, method):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 3,
                'sheet.columns': 3,
                'gravity': [0, 0, 0],
                'drag': 1.5,
                'rate': float(ticks),
                'solver.method': method,
            }
        )
    )
    cloth.velocities = np.broadcast_to((1.0, 2.0, -3.0), (3, 3, 3))
    for _ in range(ticks):
        cloth.advance(1 / ticks)
    expected = np.broadcast_to(np.array((1.0, 2.0, -3.0)) * math.exp(-1.5), (3, 3, 3))
    np.testing.assert_allclose(cloth.velocities, expected, rtol=1e-9)


@every_method
@pytest.mark.parametrize('substeps', [1, 7])
def test_drag_and_gravity_give_the_terminal_velocity_whatever_the_step(substeps, method):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 1,
                'sheet.columns': 1,
                'drag': 4.0,
                'solver.method': method,
                'solver.substeps': substeps,
            }
        )
    )
    cloth.advance(20.0)
    np.testing.assert_allclose(cloth.velocities[0, 0], (0, 0, -9.81 / 4), rtol=1e-12)


@every_method
def test_energy_is_lost_at_the_same_rate_whatever_the_tick(method):
    lost = []
    for ticks in (30, 60, 240):
        cloth = Cloth(
            Scene().with_parameters(
                {
                    'rate': float(ticks),
                    'wind.air_density': 0.0,
                    'solver.method': method,
                }
            )
        )
        start = cloth.energy()
        for _ in range(3 * ticks):
            cloth.advance(1 / ticks)
        lost.append(start - cloth.energy())
    assert max(lost) / min(lost) < 1.02


@every_method
@settings(max_examples=15, deadline=None)
@given(
    pins=st.lists(
        st.tuples(st.integers(0, 5), st.integers(0, 6)).map(lambda pin: f'{pin[0]},{pin[1]}'),
        min_size=1,
        max_size=5,
    ),
    wind=st.tuples(*[st.floats(-50, 50)] * 3),
    precision=st.sampled_from(['single', 'double']),
)
def test_pins_do_not_move_by_one_bit(pins, wind, precision, method):
    cloth = Cloth(
        Scene(
            sheet={'rows': 6, 'columns': 7, 'position': (0.3, -0.7, 1.1)},
            pins=pins,
            sphere={'radius': 0.1, 'position': (0.3, -0.7, 1.5)},
            solver={'precision': precision, 'method': method},
        )
    )
    cloth.wind = wind
    pinned, start = cloth.scene.pinned(), cloth.positions
    cloth.move_sphere((0.3, -0.7, 0.7))
    for _ in range(10):
        cloth.advance(0.02)
    assert np.array_equal(cloth.positions[pinned], start[pinned])
    assert not cloth.velocities[pinned].any()
