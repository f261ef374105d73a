"""A closed mesh from a file, as a shape with a grid of distances."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from ...grid import Array
from . import mesh_distance
from .distance_grid import choose_cell, inner_radius
from .mesh import Mesh, load_mesh, resolve
from .mesh_cache import cached_distance_grid
from .shape import Shape, enclosing_capsule

# Factor on the circumradius of triangles for which offsets are made: cloth stretches.
_MARGIN = 1.05
# Factor on the error of the grid: where that is greatest, the share of the offset is 0.9 or more.
_ERRORS = 1.1


def mesh_shape(name: str, path: str, rho: float) -> Shape:
    """
    Return the shape of a mesh.

    Parameters
    ----------
    name
        Parameter with the path, for errors.
    path
        Of an STL or OBJ file.
    rho
        Circumradius of the triangles of the undeformed sheet, m; 0: it has none.

    Raises
    ------
    ValueError
        The file cannot be read, or its mesh cannot be used.

    """
    file = resolve(path, name)
    try:
        changed = file.stat().st_mtime_ns
    except OSError:
        changed = 0  # `load_mesh` says what is wrong
    return _mesh_shape(name, path, changed, rho)


@functools.lru_cache(maxsize=16)
def _mesh_shape(name: str, path: str, changed: int, rho: float) -> Shape:
    mesh = load_mesh(path, name)
    radius = _MARGIN * rho or 0.1 * mesh.bounding_radius()
    grid = cached_distance_grid(mesh, choose_cell(mesh, radius, name, path), radius)
    cells = np.array(grid.values.shape) - 1

    def constants(point: Array) -> Sequence[float]:
        frame = (*(point - grid.origin), 1 / grid.cell, grid.cell, *cells)
        return (*frame, _ERRORS * grid.error)

    extents = np.sort(0.5 * (mesh.upper - mesh.lower))
    return Shape(
        mesh_distance.KIND,
        mesh.bounding_radius(),
        inner_radius(grid),
        float(extents[1]),
        constants,
        lambda _: np.zeros(3),
        # Of the present bound of the circumradius, which is not that of the grid.
        (grid.values.ravel(), grid.share.ravel() * (grid.rho / radius)),
        _triangles(mesh),
        enclosing_capsule(mesh.vertices),
    )


def _triangles(mesh: Mesh) -> Array:
    corners: Array = mesh.corners.copy()
    corners.flags.writeable = False
    return corners
