"""Find where a sheet passes through itself, in positions that were not simulated."""

from __future__ import annotations

import math

import numpy as np

from ...scene.parameter import invalid_value_error
from ..grid import Array
from ..kernels.jit import exact, exact_inlined
from .block_tree import Blocks
from .closest_features import closest

# Distance, in thicknesses, at which features touch: their sides cannot be told.
TOUCHING = 1e-3
# Share of that distance at which a particle is in the plane of a triangle.
_COPLANAR = 1e-2


@exact_inlined
def _volume(x, a, b, c, d):  # type: ignore[no-untyped-def]
    """Return six times the signed volume of a tetrahedron, m³."""
    ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    vx, vy, vz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    wx, wy, wz = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
    return ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)


@exact_inlined
def _pierces(x, p, q, a, b, c, least):  # type: ignore[no-untyped-def]
    """
    Return whether the edge p q passes through the triangle a b c, from one side to the other.

    Ends that are hardly off the plane do not count: they touch the triangle, or are beside it.
    """
    first, second = _volume(x, a, b, c, p), _volume(x, a, b, c, q)
    longest = 0.0
    for axis in range(3):
        e, f = abs(x[b, axis] - x[a, axis]), abs(x[c, axis] - x[a, axis])
        longest = max(longest, e, f)
    flat = _COPLANAR * least * longest * longest
    if not (min(first, second) < -flat and max(first, second) > flat):
        return False
    side = _volume(x, p, q, a, b) > 0.0
    return side == (_volume(x, p, q, b, c) > 0.0) and side == (_volume(x, p, q, c, a) > 0.0)


@exact
def _first(x, rows, columns, cells, least):  # type: ignore[no-untyped-def]
    """Return the cells of two features that touch or intersect, or -1 and -1."""
    edges, corners = np.empty((2, 5, 2), np.int64), np.empty((2, 2, 3), np.int64)
    for pair in range(len(cells)):
        real = True
        for n in range(2):
            cell = cells[pair, n]
            real = real and cell // columns + 1 < rows and cell % columns + 1 < columns
            right, below, last = cell + 1, cell + columns, cell + columns + 1
            for k, (i, j) in enumerate(
                ((cell, right), (cell, below), (right, below), (right, last), (below, last))
            ):
                edges[n, k, 0], edges[n, k, 1] = i, j
            for k, i in enumerate((cell, last)):
                corners[n, k, 0], corners[n, k, 1], corners[n, k, 2] = i, right, below
        if real and _touch(x, edges, corners, least):
            return cells[pair, 0], cells[pair, 1]
    return -1, -1


@exact_inlined
def _touch(x, edges, corners, least):  # type: ignore[no-untyped-def]
    """Return whether two cells touch or intersect."""
    for n in range(2):
        for m in range(2):
            i, j, k = corners[n, m, 0], corners[n, m, 1], corners[n, m, 2]
            for e in range(5):
                p, q = edges[1 - n, e, 0], edges[1 - n, e, 1]
                if p != i and p != j and p != k:
                    if closest(x, False, p, i, j, k)[0] < least:
                        return True
                    if q != i and q != j and q != k and _pierces(x, p, q, i, j, k, least):
                        return True
    for m in range(5):
        for e in range(5):
            i, j, k, h = edges[0, m, 0], edges[0, m, 1], edges[1, e, 0], edges[1, e, 1]
            apart = i != k and i != h and j != k and j != h
            if apart and closest(x, True, i, j, k, h)[0] < least:
                return True
    return False


def check_free_of_intersections(name: str, positions: Array, thickness: float) -> None:
    """
    Refuse positions in which the sheet passes through itself, or touches itself.

    Parameters
    ----------
    name
        What was assigned, for the error.
    positions
        m, shape (3, rows, columns).
    thickness
        m.

    Raises
    ------
    ValueError
        Names the particles.

    """
    _, rows, columns = positions.shape
    flat = np.ascontiguousarray(positions, float).reshape(3, -1)
    least = TOUCHING * thickness
    blocks = Blocks(rows, columns, float)
    blocks.bound(flat, 0, columns)
    blocks.finish()
    cells: Array = np.empty((0, 2), np.int64)
    still: Array = np.zeros(rows * columns)
    wanted = (least, least, least, still, still)
    every: Array = np.ones(rows * columns, np.bool_)
    cells = np.empty((blocks.near_cells(*wanted, cells, every), 2), np.int64)
    blocks.near_cells(*wanted, cells, every)
    a, b = _first(np.ascontiguousarray(flat.T), rows, columns, cells, least)
    if a >= 0:
        first, second = divmod(a, columns), divmod(b, columns)
        raise invalid_value_error(
            name,
            f'a sheet that passes through itself at particles {first} and {second}',
            f'layers that are apart by {least:g} m at least, better by self_contact.thickness',
            'move them apart, or set self_contact.thickness to 0',
        )


def least_thickness(diagonal: float, resolution: float) -> float:
    """Return the least thickness, m, that a precision resolves on a sheet of this diagonal."""
    # Coordinates are up to two diagonals large; distances are compared to a thousandth.
    return 2 * diagonal * resolution * math.ceil(1 / TOUCHING)
