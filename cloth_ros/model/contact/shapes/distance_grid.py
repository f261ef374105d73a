"""
Signed distance from a mesh on a regular grid.

Each node has the exact distance from the closest triangle (rounded to single precision), with the
sign of the winding number along lines of nodes.  Between the nodes the distance is interpolated:
exactly on flat faces, with errors below about half of a cell at sharp edges, and of
cell² / (4 radius) on curved surfaces.  `DistanceGrid.error` is the error measured on the surface.

Walls need `WALL_CELLS` cells; `choose_cell` makes the cells small enough for that.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ....scene.parameter import invalid_value_error
from ...grid import Array
from .box_tree import build_tree
from .mesh import Mesh
from .mesh_kernels import (
    add_crossings,
    fill_distances,
    find_feet,
    find_walls,
)
from .mesh_offset import SLOPE, limit_slope, offsets_at

# Nodes of a grid; 32 MB for both channels.
MAX_NODES = 4_000_000
# Cells in the thickness of a wall: a wall of fewer is not everywhere inside some node.
WALL_CELLS = 2.5
# Cells in the circumradius of the triangles of a sheet: a quarter of its spacing.
RADIUS_CELLS = 3.0
# Below this many the offset would be too coarse: it is made for a larger circumradius instead.
_MIN_RADIUS_CELLS = 1.5
# Cells of the grid beyond the offset: one for interpolation, one for rounding up.
_PADDING = 2.0
# Cells inside the mesh to which the offset is continued.
_DEPTH = 3.0
# Surfaces that face each other within 15° of parallel are a wall; steeper ones are an edge.
_OPPOSED = -np.cos(np.radians(15.0))
# Cells along the edge of a block of nodes that is near the mesh, or is not.
_STRIDE = 4
# Points on the surface at which walls and errors are measured, beside one on each triangle.
_SAMPLES = 50_000
# Points on each edge at which errors are measured: they are greatest there.
_EDGE_SAMPLES = 16


@dataclasses.dataclass(frozen=True)
class DistanceGrid:
    """
    Signed distance from a mesh on a grid of nodes, in the frame of the mesh.

    Attributes
    ----------
    values
        Signed distances at the nodes, m, negative inside, float32, shape (nx, ny, nz).
    share
        Offset in which particles are kept, see `mesh_offset`, as a part of `rho` in [0, 1];
        float32, of the same shape.  0 farther from the surface than `rho` and two cells, or
        deeper than three cells.
    origin
        Position of the node 0, 0, 0, m, shape (3,).
    cell
        Distance of neighbouring nodes, m.
    rho
        Circumradius of triangles for which `share` was made, m: that of the sheet or, with large
        cells, `largest_radius`.  The offset is the product of `share` and this.
    error
        Greatest interpolated distance found on the surface, m; there it should be 0.

    """

    values: Array
    share: Array
    origin: Array
    cell: float
    rho: float
    error: float


def inner_radius(grid: DistanceGrid) -> float:
    """Return the greatest depth inside the mesh, m, to within a cell."""
    return float(max(-grid.values.min(), 0.0))


def interpolate(channel: Array, grid: DistanceGrid, points: Array) -> Array:
    """Return a channel of a grid at points, m, shape (n, 3), trilinear; constant outside."""
    high = np.array(channel.shape) - 1
    places = np.clip((points - grid.origin) / grid.cell, 0, high)
    nodes = np.minimum(places.astype(np.int64), high - 1)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        weights = np.where(corner, places - nodes, 1 - (places - nodes)).prod(axis=1)
        i, j, k = (nodes + corner).T
        total += weights * channel[i, j, k]
    return total


def largest_radius(cell: float, rho: float) -> float:
    """Return the circumradius for which the offset is made, m: `rho`, or 1.5 cells if greater."""
    return max(rho, _MIN_RADIUS_CELLS * cell)


def _shape(mesh: Mesh, cell: float, rho: float) -> tuple[int, int, int]:
    rho = largest_radius(cell, rho)
    extent = mesh.upper - mesh.lower + 2 * (rho + _PADDING * cell)
    nx, ny, nz = np.ceil(extent / cell).astype(int) + 1
    return int(nx), int(ny), int(nz)


def smallest_cell(mesh: Mesh, rho: float) -> float:
    """Return the least cell with which a grid has no more than `MAX_NODES` nodes, m."""
    cell = float(np.prod(mesh.upper - mesh.lower + 2 * rho) / MAX_NODES) ** (1 / 3)
    while float(np.prod(np.array(_shape(mesh, cell, rho), float))) > MAX_NODES:
        cell *= 1.01
    return float(cell)


def choose_cell(mesh: Mesh, rho: float, name: str = 'mesh', path: str = '') -> float:
    """
    Return the cell for a mesh and a sheet, m.

    A third of `rho`, less where the walls of the mesh need it, and more where the grid would have
    too many nodes.

    Parameters
    ----------
    mesh
        The mesh.
    rho
        Greatest circumradius of the triangles of the sheet, m.
    name, path
        Parameter and file, for errors.

    Raises
    ------
    ValueError
        A wall is too thin for a grid of `MAX_NODES` nodes.

    """
    least = smallest_cell(mesh, rho)
    cell = max(rho / RADIUS_CELLS, least)
    thickness = thinnest_wall(mesh, WALL_CELLS * cell)
    if thickness < WALL_CELLS * least:
        size = ' × '.join(f'{edge:.3g}' for edge in mesh.upper - mesh.lower)
        raise invalid_value_error(
            name,
            path,
            f'a mesh whose walls are at least {1e3 * WALL_CELLS * least:.3g} mm thick at its size '
            f'of {size} m, not {1e3 * thickness:.3g} mm',
            'make it solid, split it into smaller colliders, or write type: box',
        )
    return float(min(cell, thickness / WALL_CELLS))


def surface_points(mesh: Mesh, count: int = _SAMPLES) -> tuple[Array, Array]:
    """
    Return points spread over a mesh, one or more inside each triangle.

    Returns
    -------
    (array, array)
        Points, m, shape (n, 3), and their triangles, shape (n,).

    """
    corners = mesh.corners
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    step = np.sqrt(max(areas.sum(), 1e-300) / count)
    # A long thin triangle has as many rows as its longest edge, but not that squared.
    rows = np.ceil(np.minimum(edges / step, 1 + areas / step**2)).astype(int)
    points, owners = [], []
    for row_count in np.unique(np.maximum(rows, 1)).tolist():
        chosen = np.flatnonzero(np.maximum(rows, 1) == row_count)
        i, j = np.triu_indices(row_count)
        v, w = (i + 1 / 3) / row_count, (j - i + 1 / 3) / row_count
        weights = np.stack([1 - v - w, v, w], axis=1)
        points.append((weights @ corners[chosen]).reshape(-1, 3))
        owners.append(np.repeat(chosen, len(v)))
    return np.concatenate(points), np.concatenate(owners)


def _edge_points(mesh: Mesh) -> Array:
    """Return points on the edges of the triangles, m, shape (n, 3)."""
    corners = mesh.corners
    parts = np.linspace(0.0, 1.0, _EDGE_SAMPLES, endpoint=False)[:, None, None]
    along = np.roll(corners, -1, axis=1) - corners
    return np.concatenate([(corners + part * along).reshape(-1, 3) for part in parts])


def thinnest_wall(mesh: Mesh, length: float) -> float:
    """
    Return the thickness of the thinnest wall, m; infinity if none is thinner than `length`, m.

    A wall has two surfaces that face apart, within 15° of parallel.  Measured at samples.
    """
    points, owners = surface_points(mesh)
    thickness = np.empty(len(points))
    corners = mesh.corners
    find_walls(
        *build_tree(corners), corners, mesh.normals(), points, owners, length, _OPPOSED, thickness
    )
    return float(thickness.min())


def distance_grid(mesh: Mesh, cell: float, rho: float) -> DistanceGrid:
    """
    Compute the distance grid of a mesh.

    Parameters
    ----------
    mesh
        Closed, see `closed_mesh`.
    cell
        Distance of neighbouring nodes, m, see `choose_cell`.
    rho
        Greatest circumradius of the triangles of the sheet, m.

    Raises
    ------
    ValueError
        The grid would have more than `MAX_NODES` nodes.

    """
    shape = _shape(mesh, cell, rho)
    if np.prod(np.array(shape, float)) > MAX_NODES:
        least = smallest_cell(mesh, rho)
        raise invalid_value_error(
            'cell', cell, f'at least {least:.3g} m for a mesh of this size', f'write {least:.3g}'
        )
    origin = (mesh.lower + mesh.upper) / 2 - cell * (np.array(shape) - 1) / 2
    rho = largest_radius(cell, rho)
    values, owners = _signed_distances(mesh, origin, cell, shape, rho)
    share = _share(mesh, values, owners, origin, cell, rho)
    grid = DistanceGrid(values, share, origin, cell, rho, 0.0)
    points = np.concatenate([surface_points(mesh)[0], _edge_points(mesh)])
    surface = interpolate(values, grid, points)
    return dataclasses.replace(grid, error=float(np.abs(surface).max()))


def _inside(mesh: Mesh, origin: Array, cell: float, shape: tuple[int, ...]) -> Array:
    """Return which nodes are inside the mesh, bool."""
    steps = np.zeros((*shape[:2], shape[2] + 1), np.int16)
    add_crossings(mesh.vertices, mesh.triangles, origin, cell, steps)
    np.cumsum(steps, axis=2, out=steps)
    return np.asarray(steps[:, :, :-1] > 0)


def _signed_distances(
    mesh: Mesh, origin: Array, cell: float, shape: tuple[int, int, int], rho: float
) -> tuple[Array, Array]:
    """
    Return the distances of the nodes, and their closest triangles.

    Returns
    -------
    (array, array)
        Signed distances, m, and triangles, -1 where the distance is interpolated from distances
        of every fourth node: deeper inside and farther away than `share` is needed.

    """
    tree, corners = build_tree(mesh.corners), mesh.corners
    blocks = tuple((count - 1) // _STRIDE + 2 for count in shape)
    coarse, owners = np.zeros(blocks), np.empty(blocks, np.int32)
    everywhere = np.ones(blocks, bool)
    wide = _STRIDE * cell
    fill = (*tree, corners, origin)
    fill_distances(*fill, wide, 0, blocks[0], coarse, everywhere, 1, coarse, owners)
    signed = np.where(_inside(mesh, origin, wide, blocks), -coarse, coarse)
    # A point of a block is within half its diagonal of a corner, and the distance changes by less.
    reach = 0.87 * wide
    needed = (signed > -_DEPTH * cell - reach) & (signed < rho + _PADDING * cell + reach)
    near = np.zeros(blocks, bool)
    for corner in np.ndindex(2, 2, 2):
        shifted = needed[tuple(slice(step, None) for step in corner)]
        near[tuple(slice(count) for count in shifted.shape)] |= shifted
    values, owners = np.empty(shape, np.float32), np.empty(shape, np.int32)
    for i in range(shape[0]):  # an interrupt is handled in between
        fill_distances(*fill, cell, i, i + 1, coarse, near, _STRIDE, values, owners)
    np.negative(values, out=values, where=_inside(mesh, origin, cell, shape))
    return values, owners


def _share(
    mesh: Mesh, values: Array, owners: Array, origin: Array, cell: float, rho: float
) -> Array:
    """Return the channel `share` of the grid."""
    share = np.zeros(values.shape, np.float32)
    near = (values > -_DEPTH * cell) & (values < rho + _PADDING * cell)
    nodes, chosen = np.argwhere(near), owners[near]
    numbers = np.full(values.shape, -1, np.int32)
    numbers[near] = np.arange(len(nodes))
    points = origin + cell * nodes
    feet = np.empty(points.shape)
    find_feet(mesh.corners, points, chosen, feet)
    outwards = (points - feet) * np.where(values[near] < 0, -1.0, 1.0)[:, None]
    distances = np.linalg.norm(outwards, axis=1)
    on_surface = distances < 1e-6 * cell
    normals = outwards / np.where(on_surface, 1.0, distances)[:, None]
    normals[on_surface] = mesh.normals()[chosen[on_surface]]
    offsets = offsets_at(mesh, feet, normals, rho)
    while limit_slope(numbers, nodes, feet, normals, SLOPE, offsets):
        pass
    share[near] = offsets / rho
    return share
