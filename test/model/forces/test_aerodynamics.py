"""Air: the compiled force against the reference model, and its limits at high speeds."""

import math

import numpy as np
import pytest
from builders import SPRINGS_ONLY, cloth_of, crumple, examples, precisions, seeds, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.integrators.integrator import Step
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.tradeoff.reference_model import acceleration

# Air alone, on a free sheet without springs.
AIR_ONLY = {
    **SPRINGS_ONLY,
    'wind__air_density': 1.2,
    'springs__structural': 0.0,
    'springs__shear': 0.0,
    'springs__bending': 0.0,
}


@examples(0.3)
@given(seeds, st.integers(3, 7), st.integers(3, 7))
def test_a_short_kick_is_the_acceleration_of_the_reference_model(seed, rows, columns):
    """By springs, dashpots, gravity, drag and air together."""
    cloth = cloth_of(
        sheet__rows=rows,
        sheet__columns=columns,
        springs__damping=0.01,
        drag=2.0,
        solver__precision='double',
    )
    state = crumple(cloth, 0.05, seed, speed=3.0)._simulation.state
    air_velocity = tuple(np.random.default_rng(seed + 1).normal(0, 5, 3))
    before, seconds = state.velocities, 1e-7
    expected = acceleration(cloth.scene, state.world_positions, before, air_velocity)
    KickDrift(cloth.scene, state.grid, state.dtype).apply(
        state, (Step(seconds, 0.0),), air_velocity
    )
    found = (state.velocities - before) / seconds
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


def test_a_free_sheet_ends_with_the_velocity_of_the_wind():
    cloth = small_cloth(pins=[''], drag=0.0, gravity=(0.0, 0.0, 0.0))
    cloth.wind = (0.0, 0.0, 7.0)
    cloth.advance(60.0)
    np.testing.assert_allclose(cloth.velocities.mean((0, 1)), (0.0, 0.0, 7.0), atol=0.02)


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('drag', [0.0, 2.0])
@pytest.mark.parametrize('substeps', [1, 60])
def test_the_terminal_velocity_is_exact_for_every_step(drag, substeps, method):
    sheet = {'sheet__rows': 9, 'sheet__columns': 9, 'gravity': [0.0, 0.0, -9.81], 'drag': drag}
    solver = {'solver__method': method, 'solver__substeps': substeps}
    cloth = cloth_of(**{**AIR_ONLY, **sheet, **solver, 'solver__precision': 'double'})
    # Without springs each particle falls alone; an inner one has the area dx dy.
    k = 0.5 * 1.2 * (1 / 8) ** 2 / cloth.scene.sheet.particle_mass  # k v² + drag v = g
    terminal = (-drag + math.sqrt(drag**2 + 4 * k * 9.81)) / (2 * k)
    cloth.velocities = np.broadcast_to((0, 0, -terminal), (9, 9, 3))
    cloth.advance(cloth.substep)
    # Particles at the edges fall faster, and turn the triangles of their neighbours.
    np.testing.assert_allclose(cloth.velocities[2:-2, 2:-2, 2], -terminal, rtol=1e-12)
    cloth.reset()
    cloth.advance(0.25)
    assert 0.7 * terminal < -cloth.velocities[4, 4, 2] <= terminal


@examples(0.3)
@given(st.floats(0, 1e4), seeds, st.floats(1e-4, 1.0), precisions)
def test_no_particle_becomes_faster_than_the_wind(speed, seed, seconds, precision):
    cloth = small_cloth(**AIR_ONLY, solver__precision=precision, sheet__mass=1e-4)
    crumple(cloth, 0.1, seed)
    direction = np.random.default_rng(seed).normal(size=3)
    wind = speed * direction / np.linalg.norm(direction)
    cloth.wind = wind
    cloth.advance(seconds)
    relative = np.linalg.norm(cloth.velocities - wind, axis=-1)
    assert relative.max() <= speed * (1 + 1e-5) + 1e-6
