"""Systems whose solution is known exactly."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.methods import METHODS

UPRIGHT = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]  # rows run down, along -z


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


def frequency(times: np.ndarray, values: np.ndarray) -> float:
    """Angular frequency from the falling zero crossings, each interpolated."""
    i = np.nonzero((values[:-1] > 0) & (values[1:] <= 0))[0]
    crossing = times[i] + (times[i + 1] - times[i]) * values[i] / (values[i] - values[i + 1])
    return float(2 * np.pi * (len(crossing) - 1) / (crossing[-1] - crossing[0]))


@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('substeps', [40, 200])
def test_free_fall_is_exact_to_the_rounding_of_the_method(precision, substeps):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 6,
                'sheet.columns': 7,
                'solver.precision': precision,
                'solver.substeps': substeps,
            }
        )
    )
    start = cloth.positions
    for _ in range(60):
        cloth.advance(1 / 60)
    # Symplectic Euler: n (n + 1) / 2 steps' worth of g h², where the fall itself has n² / 2.
    h, n = cloth.substep, 60 * substeps
    fall = 9.81 * h * h * n * (n + 1) / 2
    eps = np.finfo(np.float32 if precision == 'single' else np.float64).eps
    error = np.abs(cloth.positions - start - (0, 0, -fall)).max()
    assert error < 5 * n * eps
    assert fall == pytest.approx(0.5 * 9.81, rel=1.01 / n)
    assert cloth.largest_strain() < 1e-9 if precision == 'double' else 2e-3


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_hanging_chain_sags_by_the_weights_below(precision):
    n, mass, stiffness = 11, 0.2, 500.0
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': n,
                'sheet.columns': 1,
                'sheet.orientation': UPRIGHT,
                'sheet.mass': mass,
                'pins': ['0,0'],
                'springs.structural': stiffness,
                'drag': 20.0,
                'solver.precision': precision,
            }
        )
    )
    cloth.advance(10.0)
    sag = -np.diff(cloth.positions[:, 0, 2]) - 1 / (n - 1)
    below = np.arange(n - 1, 0, -1) * mass / n
    np.testing.assert_allclose(sag, below * 9.81 / stiffness, rtol=1e-3)


@pytest.mark.parametrize('mode', [1, 2, 5, 10])
def test_a_chain_vibrates_in_its_modes(mode):
    n, mass, stiffness = 10, 0.2, 500.0  # free particles between two pinned ones
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 1,
                'sheet.columns': n + 2,
                'sheet.mass': mass,
                'gravity': [0, 0, 0],
                'pins': ['0,0', '0,-1'],
                'springs.structural': stiffness,
            }
        )
    )
    shape = np.sin(mode * np.pi * np.arange(n + 2) / (n + 1))
    rest = cloth.positions
    displaced = rest.copy()
    displaced[0, :, 0] += 1e-3 * shape
    cloth.positions = displaced
    times, values = [], []
    for _ in range(4000):
        cloth.advance(cloth.substep)
        times.append(cloth.time)
        values.append((cloth.positions - rest)[0, :, 0] @ shape)
    found = frequency(np.array(times), np.array(values))
    particle = mass / (n + 2)
    exact = 2 * math.sqrt(stiffness / particle) * math.sin(mode * np.pi / 2 / (n + 1))
    assert found == pytest.approx(exact, rel=1e-3)
    # And to ten times that, the frequency that symplectic Euler is known to have.
    h = cloth.substep
    assert found == pytest.approx(2 / h * math.asin(exact * h / 2), rel=1e-4)


@pytest.mark.parametrize('degrees', [10, 60, 120])
def test_a_stiff_pendulum_swings_with_the_period_of_the_elliptic_integral(degrees):
    length, amplitude = 1.0, math.radians(degrees)
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 1,
                'sheet.columns': 2,
                'sheet.size': [length, 1.0],
                'pins': ['0,0'],
                'springs.structural': 2e5,
                'sheet.position': [0, 0, 0],
                'solver.substeps': 400,
            }
        )
    )
    pivot = cloth.positions[0, 0]
    start = pivot + length * np.array([math.sin(amplitude), 0, -math.cos(amplitude)])
    cloth.positions = np.stack([pivot, start])[None]
    times, values = [], []
    for _ in range(60 * 12):
        cloth.advance(1 / 60)
        times.append(cloth.time)
        arm = cloth.positions[0, 1] - pivot
        values.append(math.atan2(arm[0], -arm[2]))
    period = 2 * np.pi / frequency(np.array(times), np.array(values))
    # Complete elliptic integral by the arithmetic-geometric mean.
    a, b = 1.0, math.cos(amplitude / 2)
    for _ in range(30):
        a, b = (a + b) / 2, math.sqrt(a * b)
    assert period == pytest.approx(2 * np.pi * math.sqrt(length / 9.81) / a, rel=1e-3)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(['single', 'double']))
def test_momentum_is_kept_without_outer_forces(seed, precision):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 8,
                'sheet.columns': 9,
                'gravity': [0, 0, 0],
                'springs.shear': 100.0,
                'springs.bending': 20.0,
                'springs.damping': 0.01,
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
        # Symplectic Euler keeps the angular momentum about any point as well.
        before, after = np.cross(p, v).sum((0, 1)), np.cross(q, w).sum((0, 1))
        np.testing.assert_allclose(after, before, atol=1e-9 * np.abs(np.cross(p, v)).sum())


@pytest.mark.parametrize('name', METHODS)
def test_a_method_has_the_order_that_it_declares(name):
    """Error at a fixed time against the step, as a slope; a swinging net of 3 × 3 in double."""
    positions = {}
    for substeps in (400, 800, 1600, 25_600):
        cloth = Cloth(
            scene(
                **{
                    'sheet.rows': 3,
                    'sheet.columns': 3,
                    'pins': ['0,:'],
                    'springs.shear': 250.0,
                    'solver.method': name,
                    'solver.substeps': substeps,
                    'drag': 0.3,
                }
            )
        )
        cloth.advance(0.25)
        positions[substeps] = cloth.positions
    errors = [np.abs(positions[n] - positions[25_600]).max() for n in (400, 800, 1600)]
    slopes = np.diff(np.log2(errors))
    np.testing.assert_allclose(-slopes, METHODS[name].order, atol=0.1)


def test_energy_stays_without_damping():
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 10,
                'sheet.columns': 10,
                'pins': ['0,0', '0,-1'],
                'springs.shear': 250.0,
                'springs.bending': 50.0,
            }
        )
    )
    start = cloth.energy()
    swing = 0.2 * 9.81 * 1.0  # J, what the fall of the sheet by its length turns over
    for _ in range(20):
        cloth.advance(1.0)
        assert abs(cloth.energy() - start) < 0.01 * swing


@pytest.mark.parametrize('ticks', [30, 60, 240])
def test_velocity_decays_at_the_rate_given(ticks):
    cloth = Cloth(
        scene(
            **{
                'sheet.rows': 3,
                'sheet.columns': 3,
                'gravity': [0, 0, 0],
                'drag': 1.5,
                'rate': float(ticks),
            }
        )
    )
    cloth.velocities = np.broadcast_to((1.0, 2.0, -3.0), (3, 3, 3))
    for _ in range(ticks):
        cloth.advance(1 / ticks)
    expected = np.broadcast_to(np.array((1.0, 2.0, -3.0)) * math.exp(-1.5), (3, 3, 3))
    np.testing.assert_allclose(cloth.velocities, expected, rtol=1e-9)


def test_drag_and_gravity_give_the_terminal_velocity_whatever_the_step():
    for substeps in (1, 7):
        cloth = Cloth(
            scene(
                **{
                    'sheet.rows': 1,
                    'sheet.columns': 1,
                    'drag': 4.0,
                    'solver.substeps': substeps,
                }
            )
        )
        cloth.advance(20.0)
        np.testing.assert_allclose(cloth.velocities[0, 0], (0, 0, -9.81 / 4), rtol=1e-12)


def test_energy_is_lost_at_the_same_rate_whatever_the_tick():
    lost = []
    for ticks in (30, 60, 240):
        cloth = Cloth(Scene().with_parameters({'rate': float(ticks), 'wind.air_density': 0.0}))
        start = cloth.energy()
        for _ in range(3 * ticks):
            cloth.advance(1 / ticks)
        lost.append(start - cloth.energy())
    assert max(lost) / min(lost) < 1.02


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
def test_pins_do_not_move_by_one_bit(pins, wind, precision):
    cloth = Cloth(
        Scene(
            sheet={'rows': 6, 'columns': 7, 'position': (0.3, -0.7, 1.1)},
            pins=pins,
            sphere={'radius': 0.1, 'position': (0.3, -0.7, 1.5)},
            solver={'precision': precision},
        )
    )
    cloth.wind = wind
    pinned, start = cloth.scene.pinned(), cloth.positions
    cloth.move_sphere((0.3, -0.7, 0.7))
    for _ in range(10):
        cloth.advance(0.02)
    assert np.array_equal(cloth.positions[pinned], start[pinned])
    assert not cloth.velocities[pinned].any()
