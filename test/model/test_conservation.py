"""Conserved quantities, exact solutions and symmetries, for every integrator and step."""

import math

import numpy as np
import pytest
from builders import (
    NEGLIGIBLE_AIR,
    SPRINGS_ONLY,
    VACUUM,
    cloth_of,
    crumple,
    examples,
    precisions,
    scene_of,
    seeds,
    small_cloth,
)
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth
from cloth_ros.model.grid import rotation_matrix
from cloth_ros.model.integrators import INTEGRATORS

every_method = pytest.mark.parametrize('method', INTEGRATORS)


@every_method
@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('substeps', [60, 200])
def test_a_falling_sheet_keeps_its_shape_to_rounding(precision, substeps, method):
    cloth = small_cloth(
        **VACUUM,
        pins=[''],
        solver__method=method,
        solver__precision=precision,
        solver__substeps=substeps,
    )
    start = cloth.positions
    cloth.advance(1.0)
    error = np.abs(cloth.positions - start - (0, 0, -9.81 / 2)).max()
    rounding = np.finfo(np.float32 if precision == 'single' else np.float64).eps
    assert error < 5 * 60 * substeps * rounding
    assert cloth.largest_strain() < (1e-9 if precision == 'double' else 2e-3)


@every_method
@examples(0.2)
@given(seed=seeds, precision=precisions)
def test_momentum_is_conserved_without_external_forces(seed, precision, method):
    cloth = small_cloth(
        **{**SPRINGS_ONLY, **NEGLIGIBLE_AIR},
        springs__damping=0.01,
        solver__method=method,
        solver__precision=precision,
    )
    crumple(cloth, 0.05, seed, speed=1.0)
    p, v = cloth.positions, cloth.velocities
    cloth.advance(0.5)
    q, w = cloth.positions, cloth.velocities
    tight = 1e-12 if precision == 'double' else 1e-3
    np.testing.assert_allclose(w.mean((0, 1)), v.mean((0, 1)), atol=tight)
    np.testing.assert_allclose((q - p).mean((0, 1)), 0.5 * w.mean((0, 1)), atol=tight)
    if precision == 'double':
        # Kicks along the springs and drifts along the velocities keep the angular momentum.
        before, after = np.cross(p, v).sum((0, 1)), np.cross(q, w).sum((0, 1))
        np.testing.assert_allclose(after, before, atol=1e-9 * np.abs(np.cross(p, v)).sum())


@every_method
def test_energy_is_conserved_without_damping(method):
    sheet = {'sheet__rows': 10, 'sheet__columns': 10, 'solver__precision': 'double'}
    cloth = cloth_of(**VACUUM, **sheet, solver__method=method)
    start = cloth.energy()
    swing = 0.2 * 9.81 * 1.0  # J, converted in a fall of the sheet by its length
    for _ in range(20):
        cloth.advance(1.0)
        assert abs(cloth.energy() - start) < 0.002 * swing


@every_method
@pytest.mark.parametrize('ticks', [30, 240])
def test_velocities_decay_at_the_rate_of_the_drag(ticks, method):
    cloth = small_cloth(
        **{**SPRINGS_ONLY, 'drag': 1.5, 'rate': float(ticks)},
        solver__precision='double',
        solver__method=method,
    )
    start = np.broadcast_to((1.0, 2.0, -3.0), (6, 7, 3))
    cloth.velocities = start
    cloth.advance(1.0)
    np.testing.assert_allclose(cloth.velocities, start * math.exp(-1.5), rtol=1e-9)


@every_method
@pytest.mark.parametrize('substeps', [1, 7])
def test_drag_and_gravity_give_the_exact_terminal_velocity_for_every_step(substeps, method):
    cloth = cloth_of(
        sheet__rows=1,
        sheet__columns=1,
        pins=[''],
        drag=4.0,
        solver__precision='double',
        solver__method=method,
        solver__substeps=substeps,
    )
    cloth.advance(20.0)
    np.testing.assert_allclose(cloth.velocities[0, 0], (0, 0, -9.81 / 4), rtol=1e-12)


@every_method
def test_energy_is_dissipated_at_the_same_rate_for_every_tick(method):
    lost = []
    for ticks in (30, 60, 240):
        cloth = cloth_of(rate=float(ticks), wind__air_density=0.0, solver__method=method)
        start = cloth.energy()
        for _ in range(3 * ticks):
            cloth.advance(1 / ticks)
        lost.append(start - cloth.energy())
    assert max(lost) / min(lost) < 1.02


@every_method
@examples(0.15)
@given(
    pins=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 6)), min_size=1, max_size=5),
    wind=st.tuples(*[st.floats(-50, 50)] * 3),
    precision=precisions,
)
def test_pins_do_not_move_by_one_bit(pins, wind, precision, method):
    cloth = small_cloth(
        sheet__position=(0.3, -0.7, 1.1),
        pins=[f'{row},{column}' for row, column in pins],
        sphere={'radius': 0.1, 'position': (0.3, -0.7, 1.5)},
        solver={'precision': precision, 'method': method},
    )
    pinned, start = cloth.scene.pinned(), cloth.positions
    cloth.wind = wind
    cloth.move_sphere((0.3, -0.7, 0.7))
    cloth.advance(0.2)
    assert np.array_equal(cloth.positions[pinned], start[pinned])
    assert not cloth.velocities[pinned].any()


QUATERNION = (0.1, -0.5, 0.3, math.sqrt(1 - 0.1**2 - 0.5**2 - 0.3**2))
ROTATION = rotation_matrix(QUATERNION)
# Each maps a field (rows, columns, 3) to one of an equal cloth: rows and columns exchanged, both
# reversed, and turned in space.
SYMMETRIES = {
    'transposed': lambda field: np.swapaxes(field, 0, 1),
    'reversed': lambda field: field[::-1, ::-1],
    'rotated': lambda field: field @ ROTATION.T,
}


@pytest.mark.parametrize('name', SYMMETRIES)
@examples(0.1)
@given(seed=seeds)
def test_equal_cloths_move_alike(seed, name):
    """With springs, dashpots, air, drag and gravity."""
    generator, symmetry = np.random.default_rng(seed), SYMMETRIES[name]
    scene = scene_of(
        sheet__rows=5,
        sheet__columns=4,
        sheet__position=[0.0, 0.0, 0.0],
        pins=[''],
        springs__damping=0.01,
        gravity=generator.normal(0, 10, 3),
        wind__velocity=generator.normal(0, 5, 3),
        solver__precision='double',
    )
    changes = {}
    if name == 'transposed':
        changes = {'sheet.rows': 4, 'sheet.columns': 5}
    if name == 'rotated':
        changes = {
            'gravity': symmetry(np.array(scene.gravity)),
            'wind.velocity': symmetry(np.array(scene.wind.velocity)),
        }
    cloth, other = Cloth(scene), Cloth(scene.with_parameters(changes))
    crumple(cloth, 0.02, seed, speed=1.0)
    other.positions, other.velocities = symmetry(cloth.positions), symmetry(cloth.velocities)
    for each in (cloth, other):
        each.advance(0.02)
    np.testing.assert_allclose(other.positions, symmetry(cloth.positions), atol=1e-9)
    np.testing.assert_allclose(other.velocities, symmetry(cloth.velocities), atol=1e-6)
