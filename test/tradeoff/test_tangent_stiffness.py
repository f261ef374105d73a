import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Scene
from cloth_ros.tradeoff.measured_stability import states
from cloth_ros.tradeoff.reference_model import acceleration
from cloth_ros.tradeoff.tangent_stiffness import TangentStiffness, stability_limit

SHAPE = (3, 4, 5)


def crumpled(seed: int, **changes: object) -> tuple[Scene, np.ndarray]:
    """Return a scene of springs only, and positions of its sheet, shape (3, rows, columns)."""
    bare = {'gravity': [0, 0, 0], 'drag': 0.0, 'wind.air_density': 0.0}
    scene = Scene().with_parameters({'sheet.rows': 4, 'sheet.columns': 5, **bare, **changes})
    flat = np.moveaxis(states(scene)['undeformed'], -1, 0)
    return scene, flat + np.random.default_rng(seed).normal(0, 0.05, SHAPE)


def limit(scene: Scene, positions: np.ndarray) -> float:
    return stability_limit(scene, np.moveaxis(positions, 0, -1))


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    damping=st.sampled_from([0.0, 0.1]),
    pins=st.sampled_from([[''], ['0,0', '0,-1'], [':,2']]),
)
def test_the_tangent_is_the_derivative_of_the_forces(seed, damping, pins):
    scene, positions = crumpled(seed, **{'springs.damping': damping, 'pins': pins})
    tangent = TangentStiffness(scene, positions)
    field = np.random.default_rng(seed + 1).standard_normal(SHAPE) * ~scene.pinned()
    small, rest = 1e-6, np.zeros(SHAPE)

    def derivative(p: np.ndarray, v: np.ndarray) -> np.ndarray:
        ahead, behind = (acceleration(scene, positions + s * p, s * v) for s in (1, -1))
        return (ahead - behind) / 2

    stiffness = -derivative(small * field, rest) / small
    bound = 1e-5 * np.abs(stiffness).max()
    np.testing.assert_allclose(tangent.stiffness(field), stiffness, atol=bound)
    damped = -derivative(rest, field)
    np.testing.assert_allclose(tangent.damping(field), damped, rtol=1e-9, atol=1e-9)


def test_without_damping_the_limit_is_two_over_the_highest_frequency():
    scene, positions = crumpled(3)
    tangent = TangentStiffness(scene, positions)
    matrix = np.array([tangent.stiffness(unit.reshape(SHAPE)).ravel() for unit in np.eye(60)])
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-9 * np.abs(matrix).max())
    omega = math.sqrt(np.linalg.eigvalsh(matrix).max())
    assert limit(scene, positions) == pytest.approx(2 / omega, rel=1e-4)


def test_coincident_particles_and_sheets_that_cannot_move():
    scene, positions = crumpled(0, **{'springs.damping': 0.1})
    assert limit(scene.with_parameters({'pins': [':,:']}), positions) == math.inf
    loose = {f'springs.{name}': 0.0 for name in ('structural', 'shear', 'bending')}
    assert limit(scene.with_parameters(loose), positions) == math.inf
    positions[:, 1, 1] = positions[:, 1, 2]
    assert 0 < limit(scene, positions) < math.inf
    # No spring has a direction here, and none is stiff but for rounding.
    assert limit(scene, 0 * positions) > 1
