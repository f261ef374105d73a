"""Air: the compiled force against the reference model, and its limits in strong wind."""

import numpy as np
from builders import (
    SPRINGS_ONLY,
    cloth_of,
    crumple,
    examples,
    only,
    precisions,
    seeds,
    small_cloth,
)
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.integrators.integrator import Step
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.tradeoff.reference_model import acceleration


@examples(0.3)
@given(seeds, st.integers(3, 7), st.integers(3, 7))
def test_a_short_kick_is_the_acceleration_of_the_reference_model(seed, rows, columns):
    """By springs, dashpots, gravity, drag and air together."""
    cloth = cloth_of(
        **{'sheet__rows': rows, 'sheet__columns': columns, 'solver__precision': 'double'},
        **{'springs__damping': 0.01, 'drag': 2.0},
    )
    state = crumple(cloth, 0.05, seed, speed=3.0)._simulation.state
    air_velocity = tuple(np.random.default_rng(seed + 1).normal(0, 5, 3))
    before, steps = state.velocities, (Step(1e-7, 0.0),)
    expected = acceleration(cloth.scene, state.world_positions, before, air_velocity)
    KickDrift(cloth.scene, state.grid, state.dtype).apply(state, steps, air_velocity)
    found = (state.velocities - before) / 1e-7
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


def test_a_free_sheet_ends_with_the_velocity_of_the_wind():
    cloth = small_cloth(pins=[''], drag=0.0, gravity=(0.0, 0.0, 0.0))
    cloth.wind = (0.0, 0.0, 7.0)
    cloth.advance(60.0)
    np.testing.assert_allclose(cloth.velocities.mean((0, 1)), (0.0, 0.0, 7.0), atol=0.02)


@examples(0.3)
@given(st.floats(0, 1e4), seeds, st.floats(1e-4, 1.0), precisions)
def test_no_particle_becomes_faster_than_the_wind(speed, seed, seconds, precision):
    air_only = {**SPRINGS_ONLY, **only(None), 'wind__air_density': 1.2}
    cloth = small_cloth(**air_only, solver__precision=precision, sheet__mass=1e-4)
    direction = np.random.default_rng(seed).normal(size=3)
    cloth.wind = wind = speed * direction / np.linalg.norm(direction)
    crumple(cloth, 0.1, seed).advance(seconds)
    relative = np.linalg.norm(cloth.velocities - wind, axis=-1)
    assert relative.max() <= speed * (1 + 1e-5) + 1e-6
