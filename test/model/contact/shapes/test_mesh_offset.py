"""Flat triangles whose corners are kept out of the offset do not cut the mesh."""

import functools

import numpy as np
import pytest
from builders import examples, seeds
from geometry import triangle_distances
from hypothesis import given
from hypothesis import strategies as st
from meshes import SOLIDS, prism, sphere

from cloth_ros.model.contact.shapes.distance_grid import (
    DistanceGrid,
    choose_cell,
    distance_grid,
    interpolate,
    surface_points,
)
from cloth_ros.model.contact.shapes.mesh import Mesh, closed_mesh, winding_number
from cloth_ros.model.contact.shapes.mesh_offset import convex_edges, offsets_at

RHO = 0.014
# Weights of points that cover a triangle.
WEIGHTS = np.array([(i, j, 12 - i - j) for i in range(13) for j in range(13 - i)]) / 12


@functools.cache
def case(name: str) -> tuple[Mesh, DistanceGrid, np.ndarray]:
    """Return a mesh, its grid, and points on the mesh."""
    mesh = SOLIDS[name]
    return mesh, distance_grid(mesh, choose_cell(mesh, RHO), RHO), surface_points(mesh, 20_000)[0]


def random_triangles(
    points: np.ndarray, generator: np.random.Generator, count: int, rho: float = RHO
) -> np.ndarray:
    """Return triangles through points near a mesh, of circumradius `rho` or less, in any plane."""
    chosen = points[generator.integers(len(points), size=count)]
    chosen = chosen + generator.normal(size=(count, 3)) * generator.choice(
        [0, 0.1 * RHO, 0.4 * RHO], (count, 1)
    )
    radius = rho * generator.uniform(0.3, 1, count) ** 0.3
    angles = generator.uniform(0, 2 * np.pi, (count, 3))
    flat = radius[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    weights = generator.dirichlet([1, 1, 1], count)
    axes = np.linalg.qr(generator.normal(size=(count, 3, 3)))[0][:, :2]
    middle = np.sum(weights[..., None] * flat, axis=1, keepdims=True)
    return chosen[:, None] + (flat - middle) @ axes


def allowed(grid: DistanceGrid, triangles: np.ndarray) -> np.ndarray:
    """Return the triangles whose corners are all outside the offset, as the contact sees it."""
    corners = triangles.reshape(-1, 3)
    gap = interpolate(grid.values, grid, corners) - grid.rho * interpolate(
        grid.share, grid, corners
    )
    return triangles[(gap.reshape(-1, 3) >= 0).all(axis=1)]


def depths(mesh: Mesh, grid: DistanceGrid, triangles: np.ndarray) -> np.ndarray:
    """Return how deep triangles cut, m, computed without the grid where they may do so."""
    points = WEIGHTS @ triangles
    values = interpolate(grid.values, grid, points.reshape(-1, 3)).reshape(points.shape[:2])
    result = np.zeros(len(triangles))
    for n in np.flatnonzero(values.min(axis=1) < 0.5 * grid.cell):
        for m in np.argsort(values[n])[:4]:
            if winding_number(mesh.corners, points[n, m]) > 0.5:
                depth = triangle_distances(mesh.corners, points[n, m]).min()
                result[n] = max(result[n], depth)
    return result


@examples(0.25)
@given(seeds, st.sampled_from(['box', 'sphere', 'cylinder', 'L']))
def test_triangles_do_not_cut(seed, name):
    mesh, grid, points = case(name)
    triangles = random_triangles(points, np.random.default_rng(seed), 5000)
    outside = allowed(grid, triangles)
    assert depths(mesh, grid, outside).max(initial=0) <= 0.02 * grid.cell


@examples(0.1)
@given(seeds, st.floats(0.1, 2), st.sampled_from(['box', 'L']))
def test_neither_do_they_with_other_cells(seed, cells, name):
    """Cells of up to twice the circumradius."""
    mesh, _, points = case(name)
    grid = distance_grid(mesh, max(cells * RHO, 0.003), RHO)
    assert grid.rho == max(RHO, 1.5 * grid.cell)
    outside = allowed(grid, random_triangles(points, np.random.default_rng(seed), 5000))
    assert depths(mesh, grid, outside).max(initial=0) <= 0.02 * grid.cell


@examples(0.15)
@given(seeds, st.sampled_from(['cup', 'wedge']))
def test_triangles_do_not_begin_to_cut(seed, name):
    """
    Thin walls and acute edges.

    A triangle with corners on both sides is not kept out, but cannot get there: some depth is
    never found.  A triangle of circumradius RHO with both corners RHO from an acute edge could
    just pass it, hence a little less.
    """
    mesh, grid, points = case(name)
    triangles = random_triangles(points, np.random.default_rng(seed), 5000, 0.95 * RHO)
    found = depths(mesh, grid, allowed(grid, triangles)[:150])
    assert not ((found > 0.02 * grid.cell) & (found < 0.12 * grid.cell)).any()


def test_without_the_offset_they_do():
    mesh, grid, points = case('box')
    triangles = random_triangles(points, np.random.default_rng(0), 5000)
    corners = interpolate(grid.values, grid, triangles.reshape(-1, 3)).reshape(-1, 3)
    found = depths(mesh, grid, triangles[(corners >= 0).all(axis=1)])
    assert found.max() > 0.3 * RHO


def test_face_beside_an_edge():
    mesh = SOLIDS['box']
    s = np.array([0.001, 0.005, 0.01, 0.0139, 0.0141, 0.03])
    feet = np.stack([0.06 - s, np.zeros(6), np.full(6, 0.04)], axis=1)
    up = np.tile([0.0, 0, 1], (6, 1))
    expected = np.sqrt(np.maximum(RHO**2 - s**2, 0))
    assert offsets_at(mesh, feet, up, RHO) == pytest.approx(expected, abs=1e-9)


def test_finely_divided_sphere_is_a_sphere():
    radius = 0.05
    mesh = closed_mesh(sphere(radius, 160))
    points, owners = surface_points(mesh, 1000)
    offsets = offsets_at(mesh, points, mesh.normals()[owners], RHO)
    expected = np.sqrt(radius**2 + RHO**2) - radius
    assert offsets.min() > 0.9 * expected
    assert offsets.mean() == pytest.approx(expected, rel=0.2)
    assert offsets.max() < 1.4 * expected


def test_flat_and_concave_need_no_offset():
    assert len(convex_edges(SOLIDS['box'])[0]) == 12  # without the diagonals of the faces
    angle = SOLIDS['L']
    ends, _ = convex_edges(angle)
    inner = (np.abs(ends[..., :2] - 0.04) < 1e-9).all(axis=(1, 2))
    assert len(ends) == 17
    assert not inner.any()
    _, grid, _ = case('L')
    beside = np.array([[0.045, 0.045, 0], [0.06, 0.043, 0], [0.043, 0.06, 0]])
    assert interpolate(grid.share, grid, beside) == pytest.approx(0, abs=1e-6)
    middle = np.array([[0, 0, 0.04], [0.01, 0.01, 0.041]])
    _, grid, _ = case('box')
    assert interpolate(grid.share, grid, middle) == pytest.approx(0, abs=1e-6)


def test_folded_edges_count():
    thin = closed_mesh(prism([(0, 0), (0.2, -1e-6), (0.2, 1e-6)], [(0, 1, 2)], 0.1))
    ends, _ = convex_edges(thin)
    assert (np.abs(ends[..., :2]).max(axis=(1, 2)) < 1e-9).any()
