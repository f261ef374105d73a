import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import triangles

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators import INTEGRATORS


def airborne(**changes: object) -> Scene:
    """Nothing but air acts."""
    return Scene().with_parameters(
        {
            'sheet.rows': 5,
            'sheet.columns': 6,
            'pins': [''],
            'drag': 0.0,
            'gravity': [0, 0, 0],
            'springs.structural': 0.0,
            'springs.shear': 0.0,
            'springs.bending': 0.0,
            'solver.precision': 'double',
            **changes,
        }
    )


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31))
def test_the_force_is_that_of_each_triangle(seed):
    cloth = Cloth(airborne(**{'solver.substeps': 1000}))
    generator = np.random.default_rng(seed)
    cloth.positions = cloth.positions + generator.normal(0, 0.1, (5, 6, 3))
    wind = generator.normal(0, 5, 3)
    cloth.wind = wind
    corners = triangles(cloth.positions)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    normal = area / np.linalg.norm(area, axis=1)[:, None]
    # One for all: the sheet is at rest, the relative air velocity the wind.
    force = 0.5 * 1.2 * 1.0 * np.linalg.norm(wind) * (area @ wind)[:, None] * normal
    cloth.advance(cloth.substep)
    gained = cloth.velocities.sum((0, 1)) * cloth.scene.sheet.particle_mass
    # Implicit in the velocity, hence lower by the share that a substep takes of the relaxation.
    total = force.sum(0) * cloth.substep
    np.testing.assert_allclose(gained, total, atol=5e-3 * np.linalg.norm(total))


def test_still_air_slows_and_no_air_does_not():
    for density, slower in ((0.0, False), (1.2, True)):
        cloth = Cloth(airborne(**{'wind.air_density': density}))
        cloth.velocities = np.broadcast_to((0, 0, 1.0), (5, 6, 3))
        cloth.advance(0.1)
        assert bool(cloth.velocities[..., 2].max() < 1.0) == slower


def test_a_sheet_ends_with_the_wind():
    cloth = Cloth(airborne(**{'springs.structural': 500.0, 'springs.shear': 250.0}))
    cloth.wind = (0, 0, 7.0)
    cloth.advance(60.0)
    np.testing.assert_allclose(cloth.velocities.mean((0, 1)), (0, 0, 7.0), atol=0.02)


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('drag', [0.0, 2.0])
@pytest.mark.parametrize('substeps', [1, 60])
def test_the_terminal_velocity_is_exact_whatever_the_step(drag, substeps, method):
    cloth = Cloth(
        airborne(
            **{
                'sheet.rows': 9,
                'sheet.columns': 9,
                'gravity': [0, 0, -9.81],
                'drag': drag,
                'solver.method': method,
                'solver.substeps': substeps,
            }
        )
    )
    # Without springs each particle falls for itself; an inner one carries dx dy of area.
    k = 0.5 * 1.2 * (1 / 8) ** 2 / cloth.scene.sheet.particle_mass  # k v² + drag v = g
    terminal = (-drag + math.sqrt(drag**2 + 4 * k * 9.81)) / (2 * k)
    cloth.velocities = np.broadcast_to((0, 0, -terminal), (9, 9, 3))
    cloth.advance(cloth.substep)
    # Those at the edges do not fall at that speed, and a method that kicks at the end of a step
    # again has them turn the triangles of the row beside them; no others within a step.
    np.testing.assert_allclose(cloth.velocities[2:-2, 2:-2, 2], -terminal, rtol=1e-12)
    # And it is approached from rest.
    cloth.reset()
    cloth.advance(0.25)
    assert 0.7 * terminal < -cloth.velocities[4, 4, 2] <= terminal


@settings(max_examples=20, deadline=None)
@given(
    speed=st.floats(0, 1e4),
    seed=st.integers(0, 2**31),
    seconds=st.floats(1e-4, 1.0),
    precision=st.sampled_from(['single', 'double']),
)
def test_no_wind_makes_the_sheet_faster_than_itself(speed, seed, seconds, precision):
    generator = np.random.default_rng(seed)
    cloth = Cloth(airborne(**{'solver.precision': precision, 'sheet.mass': 1e-4}))
    cloth.positions = cloth.positions + generator.normal(0, 0.1, (5, 6, 3))
    direction = generator.normal(size=3)
    wind = speed * direction / np.linalg.norm(direction)
    cloth.wind = wind
    cloth.advance(seconds)
    # Seen from the air, nothing gains speed.
    relative = np.linalg.norm(cloth.velocities - wind, axis=-1)
    assert relative.max() <= speed * (1 + 1e-5) + 1e-6
