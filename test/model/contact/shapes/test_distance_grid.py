"""Signed distances on a grid, compared with distances and winding numbers in plain NumPy."""

import re

import numpy as np
import pytest
from builders import examples, seeds
from geometry import triangle_distances
from hypothesis import given
from hypothesis import strategies as st
from meshes import SOLIDS, box, cup, prism, sphere

from cloth_ros.model.contact.shapes import distance_grid as module
from cloth_ros.model.contact.shapes.distance_grid import (
    choose_cell,
    distance_grid,
    inner_radius,
    interpolate,
    smallest_cell,
    surface_points,
    thinnest_wall,
)
from cloth_ros.model.contact.shapes.mesh import Mesh, closed_mesh, winding_number

RHO = 0.014


def signed_distance(mesh: Mesh, point: np.ndarray) -> float:
    distance = triangle_distances(mesh.corners, point).min()
    return float(-distance if winding_number(mesh.corners, point) > 0.5 else distance)


def assert_exact_near(mesh: Mesh, grid: module.DistanceGrid, generator, count: int) -> None:
    """Compare nodes with the independent computation: near the mesh exactly, far away roughly."""
    nodes = generator.integers(0, grid.values.shape, (count, 3))
    for node in nodes:
        expected = signed_distance(mesh, grid.origin + grid.cell * node)
        found = grid.values[tuple(node)]
        is_near = -3 * grid.cell < expected < grid.rho + 2 * grid.cell
        tolerance = 1e-6 if is_near else 2 * grid.cell
        assert found == pytest.approx(expected, abs=tolerance)
        if abs(expected) > 1e-6:
            assert (found < 0) == (expected < 0)
        if not -3.01 * grid.cell < expected < grid.rho + 2.01 * grid.cell:
            assert grid.share[tuple(node)] == 0


@pytest.mark.parametrize('name', SOLIDS)
def test_nodes(name):
    mesh = SOLIDS[name]
    grid = distance_grid(mesh, 0.003, RHO)
    assert_exact_near(mesh, grid, np.random.default_rng(0), 120)
    assert grid.values.dtype == grid.share.dtype == np.float32
    assert grid.values.shape == grid.share.shape
    assert (grid.values[[0, -1]] > RHO).all()
    assert 0 <= grid.share.min() <= grid.share.max() <= 1


@examples(0.1)
@given(seeds, st.integers(4, 12), st.floats(0.0, 1.0))
def test_any_closed_mesh(seed, count, flatness):
    """The hull of random corners, with needles and tiny triangles, turned at random."""
    generator = np.random.default_rng(seed)
    from scipy.spatial import ConvexHull

    points = generator.normal(size=(count, 3)) * (0.05, 0.05, 0.01 + 0.04 * flatness)
    points = np.vstack([points, points[:2] + generator.normal(size=(2, 3)) * 1e-5])
    hull = ConvexHull(points)
    corners = points[hull.simplices]
    outwards = np.sum(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        * hull.equations[:, :3],
        axis=1,
    )
    corners[outwards < 0] = corners[outwards < 0][:, ::-1]
    mesh = closed_mesh(corners)
    grid = distance_grid(mesh, 0.01, RHO)
    assert_exact_near(mesh, grid, generator, 30)


def test_faces_through_nodes():
    """Lines of nodes that run along edges and faces of the mesh."""
    mesh = closed_mesh(box(0.07, 0.07, 0.07))
    grid = distance_grid(mesh, 0.01, 0.01)
    nodes = grid.origin + grid.cell * np.moveaxis(np.indices(grid.values.shape), 0, -1)
    apart = np.abs(nodes) - 0.035
    assert np.abs(apart).min() < 1e-12
    outside = np.linalg.norm(np.maximum(apart, 0), axis=-1)
    expected = outside + np.minimum(apart.max(axis=-1), 0)
    near = (expected > -0.03) & (expected < 0.03)
    assert grid.values[near] == pytest.approx(expected[near], abs=1e-8)
    assert inner_radius(grid) == pytest.approx(0.03)


def test_overlapping_bodies_and_cavities():
    two = np.concatenate([box(0.1, 0.1, 0.1), box(0.1, 0.1, 0.1) + np.array([0.05, 0.02, 0.03])])
    hollow = np.concatenate([box(0.1, 0.1, 0.1), box(0.06, 0.06, 0.06)[:, ::-1]])
    for corners, point, is_inside in ((two, (0.025, 0, 0), True), (hollow, (0, 0, 0), False)):
        grid = distance_grid(closed_mesh(corners), 0.004, RHO)
        (value,) = interpolate(grid.values, grid, np.array([point], float))
        assert (value < 0) == is_inside


def test_interpolation_error():
    for cell in (0.004, 0.002):
        grid = distance_grid(closed_mesh(sphere(0.05, 40)), cell, RHO)
        assert grid.error < 0.1 * cell
        assert distance_grid(SOLIDS['box'], cell, RHO).error < 0.5 * cell
    points, _ = surface_points(SOLIDS['box'], 5000)
    flat = np.abs(np.abs(points) - (0.06, 0.05, 0.04)).min(axis=1) < 1e-9
    middle = np.sort(np.abs(points) - (0.06, 0.05, 0.04), axis=1)[:, 1] < -0.01
    assert flat.all()
    assert middle.sum() > 1000
    values = interpolate(grid.values, grid, points[:1])
    assert values.shape == (1,)
    grid = distance_grid(SOLIDS['box'], 0.0037, RHO)
    assert interpolate(grid.values, grid, points[middle]) == pytest.approx(0, abs=1e-7)


def test_same_bits_every_time():
    one, two = (distance_grid(SOLIDS['cup'], 0.004, RHO) for _ in range(2))
    for channel in ('values', 'share', 'origin'):
        assert getattr(one, channel).tobytes() == getattr(two, channel).tobytes()
    assert one.error == two.error


def test_walls_are_measured():
    assert thinnest_wall(SOLIDS['cup'], 0.02) == pytest.approx(0.006, rel=0.02)
    assert thinnest_wall(SOLIDS['box'], 0.02) == np.inf
    assert thinnest_wall(SOLIDS['wedge'], 0.02) == np.inf  # 23 degrees
    touching = np.concatenate([box(0.1, 0.1, 0.1), box(0.1, 0.1, 0.1) + np.array([0.1, 0, 0])])
    assert thinnest_wall(closed_mesh(touching), 0.05) == np.inf


def test_cells_follow_sheet_walls_and_limit(monkeypatch):
    assert choose_cell(SOLIDS['box'], RHO) == pytest.approx(RHO / 3)
    cell = choose_cell(SOLIDS['cup'], RHO)
    assert cell == pytest.approx(0.006 / 2.5, rel=0.02)
    points, owners = surface_points(SOLIDS['cup'], 3000)
    middle = points - 0.003 * SOLIDS['cup'].normals()[owners]
    grid = distance_grid(SOLIDS['cup'], cell, RHO)
    assert interpolate(grid.values, grid, middle).max() < 0
    thin = closed_mesh(cup(0.1, 0.3, 0.0005, 20))
    with pytest.raises(ValueError, match=r'a\.mesh is .*walls .* not 0\.49\d mm; make') as caught:
        choose_cell(thin, RHO, 'a.mesh', 'cup.stl')
    needed = float(re.findall(r'at least ([\d.e-]+) mm', str(caught.value))[0]) / 1000
    assert choose_cell(closed_mesh(cup(0.1, 0.3, 1.03 * needed, 20)), RHO)
    monkeypatch.setattr(module, 'MAX_NODES', 20_000)
    least = smallest_cell(SOLIDS['box'], RHO)
    assert choose_cell(SOLIDS['box'], RHO) == least
    assert 15_000 < distance_grid(SOLIDS['box'], least, RHO).values.size <= 20_000
    with pytest.raises(ValueError, match=r'cell is 0\.001, but must be at least') as caught:
        distance_grid(SOLIDS['box'], 0.001, RHO)
    assert distance_grid(SOLIDS['box'], float(str(caught.value).split()[-1]), RHO)


def test_plate_of_one_cell_is_a_wall():
    plate = closed_mesh(
        prism([(0, 0), (0.3, 0), (0.3, 0.2), (0, 0.2)], [(0, 1, 2), (0, 2, 3)], 0.003)
    )
    assert choose_cell(plate, RHO) == pytest.approx(0.0012)
