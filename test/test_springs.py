import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from reference import Equations

from cloth_ros import Cloth, Scene
from cloth_ros.model.forces.springs import spring_families
from cloth_ros.model.integrators.kick_drift import KickDrift

NOTHING_ELSE = {'drag': 0.0, 'gravity': [0, 0, 0], 'wind.air_density': 0.0, 'pins': ['']}


def acceleration(cloth: Cloth) -> np.ndarray:
    """Of every particle, m/s², as the springs give it; shape (rows, columns, 3)."""
    state = cloth._state
    kick_drift = KickDrift(cloth.scene, cloth._grid_layout, np.zeros(3), state.dtype, apart=True)
    kick_drift.accelerate(state)
    return np.moveaxis(cloth._grid_layout.grid(state.acceleration), 0, -1).astype(float)


def crumpled(seed: int, rows: int, columns: int, **changes: object) -> Cloth:
    scene = Scene().with_parameters(
        {
            'sheet.rows': rows,
            'sheet.columns': columns,
            'sheet.size': [0.7, 1.3],
            'solver.precision': 'double',
            **NOTHING_ELSE,
            **changes,
        }
    )
    generator = np.random.default_rng(seed)
    cloth = Cloth(scene)
    cloth.positions = cloth.positions + generator.normal(0, 0.1, (rows, columns, 3))
    cloth.velocities = generator.normal(0, 1, (rows, columns, 3))
    return cloth


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    rows=st.integers(1, 7),
    columns=st.integers(1, 7),
    structural=st.sampled_from([0.0, 500.0]),
    shear=st.sampled_from([0.0, 250.0]),
    bending=st.sampled_from([0.0, 50.0]),
    damping=st.sampled_from([0.0, 0.3]),
)
def test_forces_are_those_of_the_definition(
    seed, rows, columns, structural, shear, bending, damping
):
    cloth = crumpled(
        seed,
        rows,
        columns,
        **{
            'springs.structural': structural,
            'springs.shear': shear,
            'springs.bending': bending,
            'springs.damping': damping,
        },
    )
    expected = Equations(cloth.scene).springs(cloth.positions, cloth.velocities)
    expected /= cloth.scene.sheet.particle_mass
    np.testing.assert_allclose(acceleration(cloth), expected, rtol=1e-9, atol=1e-7)


def test_single_precision_gives_the_same_forces_to_its_rounding():
    double = crumpled(1, 20, 21)
    single = Cloth(double.scene.with_parameters({'solver.precision': 'single'}))
    single.positions, single.velocities = double.positions, double.velocities
    expected = acceleration(double)
    np.testing.assert_allclose(acceleration(single), expected, atol=1e-5 * np.abs(expected).max())


@settings(deadline=None)
@given(arrays(float, (3, 3, 3), elements=st.sampled_from([0.0, 1.0, 1e-20, 1e-38, -1e-9])))
def test_forces_are_finite_and_bounded_where_particles_coincide(positions):
    cloth = crumpled(0, 3, 3)
    cloth.positions = positions
    found = acceleration(cloth)
    # No spring pulls harder than its stiffness times its rest length or its stretch.
    bound = 12 * 500.0 * 4.0 / cloth.scene.sheet.particle_mass
    assert np.abs(found).max() <= bound


def test_coincident_particles_do_not_push():
    cloth = crumpled(0, 3, 3)
    cloth.positions = np.zeros((3, 3, 3))
    assert np.array_equal(acceleration(cloth), np.zeros((3, 3, 3)))


@pytest.mark.parametrize('absent', ['structural', 'shear', 'bending'])
def test_a_family_without_stiffness_is_not_modelled(absent):
    scene = Scene().with_parameters({f'springs.{absent}': 0.0})
    assert absent not in {family.name for family in spring_families(scene)}
    assert len(list(spring_families(scene))) == 4
