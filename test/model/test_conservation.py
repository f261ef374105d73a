"""Conserved quantities and symmetries; closed solutions are in `tradeoff/analytic_cases.py`."""

import numpy as np
import pytest
from builders import (
    NEGLIGIBLE_AIR,
    SPRINGS_ONLY,
    VACUUM,
    cloth_of,
    crumple,
    examples,
    masses,
    precisions,
    scene_of,
    seeds,
    small_cloth,
)
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.scene.quaternion import rotation_matrix

every_method = pytest.mark.parametrize('method', INTEGRATORS)


@every_method
@examples(0.1)
@given(seeds, precisions)
def test_momentum_is_conserved_without_external_forces(method, seed, precision):
    dashpots = {**SPRINGS_ONLY, **NEGLIGIBLE_AIR, 'springs__damping': 0.01}
    cloth = small_cloth(**dashpots, solver={'precision': precision, 'method': method})
    crumple(cloth, 0.05, seed, speed=1.0)
    p, v = cloth.positions, cloth.velocities
    cloth.advance(0.5)
    q, w = cloth.positions, cloth.velocities
    tight = 1e-12 if precision == 'double' else 1e-3
    share = masses(cloth) / cloth.scene.sheet.mass
    mean = (share * v).sum((0, 1))
    np.testing.assert_allclose((share * w).sum((0, 1)), mean, atol=tight)
    np.testing.assert_allclose((share * (q - p)).sum((0, 1)), 0.5 * mean, atol=tight)
    if precision == 'double':
        # Kicks along the springs and drifts along the velocities keep the angular momentum.
        before, after = (share * np.cross(p, v)).sum((0, 1)), (share * np.cross(q, w)).sum((0, 1))
        np.testing.assert_allclose(after, before, atol=1e-9 * np.abs(np.cross(p, v)).sum())


@every_method
def test_energy_is_conserved_without_damping(method):
    solver = {'precision': 'double', 'method': method}
    cloth = cloth_of(**VACUUM, sheet__rows=10, sheet__columns=10, solver=solver)
    start = cloth.energy()
    swing = 0.2 * 9.81 * 1.0  # J, converted in a fall of the sheet by its length
    for _ in range(20):
        cloth.advance(1.0)
        assert abs(cloth.energy() - start) < 0.002 * swing


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


ROTATION = rotation_matrix((0.1, -0.5, 0.5, 0.7))
# Each maps a field (rows, columns, 3) to that of an equal cloth.
SYMMETRIES = {
    'rows and columns exchanged': lambda field: np.swapaxes(field, 0, 1),
    'rows reversed': lambda field: field[::-1],
    'columns reversed': lambda field: field[:, ::-1],
    'rotated in space': lambda field: field @ ROTATION.T,
}


@pytest.mark.parametrize('name', SYMMETRIES)
@examples(0.05)
@given(seeds)
def test_equal_cloths_move_alike(name, seed):
    """With springs, dashpots, air, drag and gravity."""
    generator, symmetry = np.random.default_rng(seed), SYMMETRIES[name]
    vectors = {'gravity': generator.normal(0, 10, 3), 'wind__velocity': generator.normal(0, 5, 3)}
    sides = {'sheet__rows': 5, 'sheet__columns': 4, 'sheet__position': [0.0, 0.0, 0.0]}
    more = {'pins': [''], 'springs__damping': 0.01, 'solver__precision': 'double'}
    cloth = crumple(cloth_of(**sides, **vectors, **more), 0.02, seed, speed=1.0)
    if name.startswith('rotated'):
        vectors = {name: symmetry(vector) for name, vector in vectors.items()}
    if name.endswith('exchanged'):
        sides |= {'sheet__rows': 4, 'sheet__columns': 5}
    other = Cloth(scene_of(**sides, **vectors, **more))
    other.positions, other.velocities = symmetry(cloth.positions), symmetry(cloth.velocities)
    for each in (cloth, other):
        each.advance(0.02)
    np.testing.assert_allclose(other.positions, symmetry(cloth.positions), atol=1e-9)
    np.testing.assert_allclose(other.velocities, symmetry(cloth.velocities), atol=1e-6)


@pytest.mark.parametrize('pins', [[''], ['0,0', '0,-1'], ['0,:'], ['::2,0', '::2,-1']])
@examples(0.1)
@given(st.integers(2, 12), st.integers(2, 12), st.floats(-5, 5), st.floats(-5, 5))
def test_a_symmetric_scene_stays_symmetric(pins, rows, columns, y, z):
    """With springs, dashpots, drag, air, wind and gusts in the plane of symmetry."""
    sheet = {'sheet__rows': rows, 'sheet__columns': columns, 'sheet__position': [0.0, 0.0, 0.0]}
    gusts = {'period': 0.05, 'duration': 0.02, 'direction': [0.0, 1.0, 0.5], 'speed': [1.0, 5.0]}
    air = {f'wind__gust__{name}': value for name, value in gusts.items()}
    more = {'pins': pins, 'springs__damping': 1e-3, 'solver__precision': 'double'}
    cloth = cloth_of(**sheet, **air, **more, wind__velocity=[0.0, y, z])
    cloth.advance(0.2)
    mirrored = cloth.positions[:, ::-1] * (-1, 1, 1)
    np.testing.assert_allclose(cloth.positions, mirrored, rtol=0, atol=1e-9)
