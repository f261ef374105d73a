"""Springs, dashpots and air: the compiled forces against the reference model."""

import numpy as np
import pytest
from builders import (
    SPRINGS_ONLY,
    cloth_of,
    crumple,
    examples,
    momentum,
    only,
    precisions,
    seeds,
    small_cloth,
)
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cloth_ros import Cloth
from cloth_ros.model.forces.springs import SPRING_TYPES
from cloth_ros.model.integrators.integrator import Step
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.scene.quaternion import rotation_matrix
from cloth_ros.tradeoff.reference_model import acceleration, spring_forces, tributary_areas

OBLONG = {'sheet__size': [0.7, 1.3], 'springs__damping': 0.3, 'solver__precision': 'double'}


def spring_accelerations(cloth: Cloth) -> np.ndarray:
    state = cloth._simulation.state
    KickDrift(cloth.scene, state.grid, state.dtype, separate=True).accelerate(state)
    return state.grid.interior(state.acceleration).astype(float)


@pytest.mark.parametrize('name', SPRING_TYPES)
@examples(0.1)
@given(seeds, st.integers(1, 7), st.integers(1, 7))
def test_each_type_of_springs_alone(name, seed, rows, columns):
    sheet = {**OBLONG, 'sheet__rows': rows, 'sheet__columns': columns}
    cloth = crumple(cloth_of(**{**SPRINGS_ONLY, **sheet, **only(name)}), 0.1, seed, speed=1.0)
    state = cloth._simulation.state
    expected = spring_forces(cloth.scene, state.world_positions, state.velocities)
    expected /= cloth.scene.sheet.cell_mass * tributary_areas(rows, columns)
    limit = 1e-12 * max(np.abs(expected).max(), 1.0)
    np.testing.assert_allclose(spring_accelerations(cloth), expected, rtol=0, atol=limit)


@examples(0.25)
@given(seeds, st.integers(3, 7), st.integers(3, 7), precisions)
def test_all_forces_together_in_a_short_kick(seed, rows, columns, precision):
    """Springs, dashpots, gravity, drag and air."""
    sheet = {**OBLONG, 'sheet__rows': rows, 'sheet__columns': columns, 'drag': 2.0}
    cloth = cloth_of(**{**sheet, 'springs__damping': 0.01, 'solver__precision': precision})
    state = crumple(cloth, 0.05, seed, speed=3.0)._simulation.state
    air_velocity = tuple(np.random.default_rng(seed + 1).normal(0, 5, 3))
    before, double = state.velocities, precision == 'double'
    seconds, tolerance = (1e-7, 1e-4) if double else (1e-5, 1e-3)
    expected = acceleration(cloth.scene, state.world_positions, before, air_velocity)
    kick_drift = KickDrift(cloth.scene, state.grid, state.dtype)
    kick_drift.apply(state, (Step(seconds, 0.0),), air_velocity)
    found = (state.velocities - before) / seconds
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@examples(0.15)
@given(arrays(float, (3, 3, 3), elements=st.sampled_from([0.0, 1.0, 1e-20, 1e-38, -1e-9])))
def test_spring_forces_are_bounded_where_particles_coincide(positions):
    cloth = cloth_of(**OBLONG, gravity=(0, 0, 0), pins=[''], sheet__rows=3, sheet__columns=3)
    cloth.positions = positions
    # No spring pulls harder than its stiffness times its rest length or its elongation.
    bound = 12 * 500.0 * 4.0 / cloth.scene.sheet.cell_mass
    assert np.abs(spring_accelerations(cloth)).max() <= bound
    cloth.positions = 0 * positions
    assert not spring_accelerations(cloth).any()


def test_both_ends_of_a_spring_feel_the_same_force():
    """A free sheet on which nothing acts stays at rest, whatever is rounded."""
    sheet = {'sheet__rows': 2, 'sheet__columns': 11, 'sheet__size': [2.2, 2.4]}
    cloth = cloth_of(**SPRINGS_ONLY, **sheet, springs__structural=1e6)
    cloth.advance(0.3)
    assert np.abs(momentum(cloth)).max() < 0.01 * cloth.scene.sheet.mass  # kg m/s
    assert cloth.energy() < 0.01  # J


@examples(0.2)
@given(seeds, st.integers(2, 9), st.integers(2, 9))
def test_even_wind_accelerates_every_particle_of_a_flat_sheet_alike(seed, rows, columns):
    generator = np.random.default_rng(seed)
    wind, orientation = generator.normal(0, 3, 3), generator.normal(size=4)
    sheet = {'sheet__rows': rows, 'sheet__columns': columns, 'sheet__size': [0.7, 1.3]}
    air = {'wind__air_density': 1.2, 'wind__velocity': wind, 'sheet__orientation': orientation}
    cloth = cloth_of(**{**SPRINGS_ONLY, **sheet, **air}, solver__precision='double')
    cloth.advance(seconds := 1e-7)
    normal = rotation_matrix(cloth.scene.sheet.orientation)[:, 2]
    force = 0.5 * 1.2 * np.linalg.norm(wind) * (wind @ normal) * normal  # N/m²
    expected = force * 0.7 * 1.3 / cloth.scene.sheet.mass
    found = cloth.velocities / seconds
    np.testing.assert_allclose(found - found[0, 0], 0, atol=1e-7 * np.abs(expected).max())
    np.testing.assert_allclose(found[0, 0], expected, rtol=1e-4, atol=1e-6)


@examples(0.15)
@given(st.floats(0, 1e4), seeds, st.floats(1e-4, 1.0), precisions)
def test_the_wind_makes_no_particle_faster_than_itself(speed, seed, seconds, precision):
    air_only = {**SPRINGS_ONLY, **only(None), 'wind__air_density': 1.2}
    cloth = small_cloth(**air_only, solver__precision=precision, sheet__mass=1e-4)
    direction = np.random.default_rng(seed).normal(size=3)
    cloth.wind = wind = speed * direction / np.linalg.norm(direction)
    crumple(cloth, 0.1, seed).advance(seconds)
    relative = np.linalg.norm(cloth.velocities - wind, axis=-1)
    assert relative.max() <= speed * (1 + 1e-5) + 1e-6
