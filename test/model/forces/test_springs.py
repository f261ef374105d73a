"""Springs and dashpots: the compiled forces against the reference model."""

import numpy as np
import pytest
from builders import SPRINGS_ONLY, cloth_of, crumple, examples, precisions, seeds
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cloth_ros import Cloth
from cloth_ros.model.forces.springs import SPRING_TYPES
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.tradeoff.reference_model import spring_forces

STIFFNESS = {'structural': 500.0, 'shear': 250.0, 'bending': 50.0}


def spring_cloth(rows: int, columns: int, only: str | None = None, **parameters: object) -> Cloth:
    """Return a free oblong sheet with dashpots, and with all types of springs or only one."""
    stiffness = {
        f'springs__{name}': value if only in (None, name) else 0.0
        for name, value in STIFFNESS.items()
    }
    # With all types there is air, which has no part in these accelerations: other tests use the
    # same kernel.
    air = {} if only else {'wind__air_density': 1.2}
    sheet = {'sheet__rows': rows, 'sheet__columns': columns, 'sheet__size': [0.7, 1.3]}
    dashpots = {'springs__damping': 0.3}
    return cloth_of(**{**SPRINGS_ONLY, **air, **sheet, **stiffness, **dashpots, **parameters})


def accelerations(cloth: Cloth) -> np.ndarray:
    """Return the accelerations by springs and dashpots, m/s², shape (3, rows, columns)."""
    state = cloth._simulation.state
    KickDrift(cloth.scene, state.grid, state.dtype, separate=True).accelerate(state)
    return state.grid.interior(state.acceleration).astype(float)


def check_accelerations(cloth: Cloth, tolerance: float) -> None:
    state = cloth._simulation.state
    expected = spring_forces(cloth.scene, state.world_positions, state.velocities)
    expected /= cloth.scene.sheet.particle_mass
    limit = tolerance * max(np.abs(expected).max(), 1.0)
    np.testing.assert_allclose(accelerations(cloth), expected, rtol=0, atol=limit)


@examples(0.3)
@given(seeds, st.integers(3, 7), st.integers(3, 7), precisions)
def test_forces_of_all_springs_agree_with_the_reference_model(seed, rows, columns, precision):
    cloth = crumple(spring_cloth(rows, columns, solver__precision=precision), 0.1, seed, speed=1.0)
    check_accelerations(cloth, 1e-12 if precision == 'double' else 1e-5)


@pytest.mark.parametrize('only', SPRING_TYPES)
@examples(0.2)
@given(seeds, st.integers(1, 7), st.integers(1, 7))
def test_forces_of_each_type_alone_agree_with_the_reference_model(only, seed, rows, columns):
    cloth = spring_cloth(rows, columns, only, solver__precision='double')
    check_accelerations(crumple(cloth, 0.1, seed, speed=1.0), 1e-12)


@examples(0.3)
@given(arrays(float, (3, 3, 3), elements=st.sampled_from([0.0, 1.0, 1e-20, 1e-38, -1e-9])))
def test_forces_are_finite_and_bounded_where_particles_coincide(positions):
    cloth = spring_cloth(3, 3, solver__precision='double')
    cloth.positions = positions
    # No spring pulls harder than its stiffness times its rest length or its elongation.
    bound = 12 * 500.0 * 4.0 / cloth.scene.sheet.particle_mass
    assert np.abs(accelerations(cloth)).max() <= bound


def test_springs_without_length_exert_no_force():
    cloth = spring_cloth(3, 3, solver__precision='double')
    cloth.positions = np.zeros((3, 3, 3))
    assert not accelerations(cloth).any()


def test_both_ends_of_a_spring_feel_the_same_force():
    """A free sheet on which nothing acts stays at rest, whatever is rounded."""
    cloth = cloth_of(
        **SPRINGS_ONLY,
        sheet__rows=2,
        sheet__columns=11,
        sheet__size=[2.2, 2.4],
        springs__structural=1e6,
    )
    cloth.advance(0.3)
    assert np.abs(cloth.velocities.mean((0, 1))).max() < 0.01  # m/s
    assert cloth.energy() < 0.01  # J
