import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import Equations

from cloth_ros import Scene
from cloth_ros.model.grid import flat_sheet
from cloth_ros.tradeoff.tangent_stiffness import (
    TangentStiffness,
    eigenvalue_with_largest_real_part,
    stability_limit,
)


def crumpled(seed: int, **changes: object) -> tuple[Scene, np.ndarray]:
    """Return a scene without gravity, drag or air, and positions of its sheet."""
    bare = {'gravity': [0, 0, 0], 'drag': 0.0, 'wind.air_density': 0.0}
    scene = Scene().with_parameters({'sheet.rows': 4, 'sheet.columns': 5, **bare, **changes})
    sheet = scene.sheet
    flat = flat_sheet(sheet.rows, sheet.columns, sheet.spacing, sheet.orientation)
    noise = np.random.default_rng(seed).normal(0, 0.05, flat.shape)
    return scene, np.moveaxis(flat + noise, 0, -1)


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    damping=st.sampled_from([0.0, 0.1]),
    pins=st.sampled_from([[''], ['0,0', '0,-1'], [':,2']]),
)
def test_the_tangent_is_the_derivative_of_the_forces(seed, damping, pins):
    scene, positions = crumpled(seed, **{'springs.damping': damping, 'pins': pins})
    equations, still = Equations(scene), np.zeros(3)
    tangent = TangentStiffness(scene, np.moveaxis(positions, -1, 0))
    small = 1e-6
    field = np.random.default_rng(seed + 1).standard_normal((3, 4, 5))
    field *= ~scene.pinned()
    moved = np.moveaxis(field, 0, -1)
    rest = np.zeros_like(positions)

    def difference(p: np.ndarray, v: np.ndarray) -> np.ndarray:
        ahead = equations.acceleration(positions + p, v, still)
        behind = equations.acceleration(positions - p, -v, still)
        return np.moveaxis(ahead - behind, -1, 0) / 2

    stiffness = -difference(small * moved, rest) / small
    np.testing.assert_allclose(
        tangent.stiffness(field), stiffness, atol=1e-5 * np.abs(stiffness).max()
    )
    damped = -difference(rest, moved)
    np.testing.assert_allclose(tangent.damping(field), damped, rtol=1e-9, atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), symmetric=st.booleans(), size=st.integers(1, 40))
def test_the_rightmost_eigenvalue_is_that_of_the_matrix(seed, symmetric, size):
    generator = np.random.default_rng(seed)
    matrix = generator.standard_normal((size, size))
    if symmetric:
        matrix = matrix + matrix.T
    expected = np.linalg.eigvals(matrix).real.max()
    value, mode, left = eigenvalue_with_largest_real_part(
        lambda x: matrix @ x, generator.standard_normal(size), 1e-9
    )
    assert value.real == pytest.approx(expected, rel=1e-4, abs=1e-4)
    assert left < 1e-6
    if symmetric:
        np.testing.assert_allclose(matrix @ mode, value.real * mode, atol=1e-5)


def test_without_damping_the_limit_is_two_over_the_highest_frequency():
    scene, positions = crumpled(3)
    tangent = TangentStiffness(scene, np.moveaxis(positions, -1, 0))
    matrix = np.array([tangent.stiffness(unit.reshape(3, 4, 5)).ravel() for unit in np.eye(60)])
    omega = math.sqrt(np.linalg.eigvals(matrix).real.max())
    assert stability_limit(scene, positions) == pytest.approx(2 / omega, rel=2e-3)


def test_what_cannot_move_or_has_no_springs_has_no_limit():
    scene, positions = crumpled(0)
    assert stability_limit(scene.with_parameters({'pins': [':,:']}), positions) == math.inf
    loose = {f'springs.{name}': 0.0 for name in ('structural', 'shear', 'bending')}
    assert stability_limit(scene.with_parameters(loose), positions) == math.inf


def test_the_limit_is_finite_where_particles_coincide():
    scene, positions = crumpled(0, **{'springs.damping': 0.1})
    positions[1, 1] = positions[1, 2]
    assert 0 < stability_limit(scene, positions) < math.inf
    # Where all of them do, no spring has a direction and nothing is stiff.
    assert stability_limit(scene, 0 * positions) == math.inf
