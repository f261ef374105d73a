"""Find where a sheet passes through itself, in positions that were not simulated."""

from __future__ import annotations

import math

import numpy as np

from ...scene.parameter import invalid_value_error
from ..grid import Array
from ..kernels.jit import exact, exact_inlined
from .closest_features import closest
from .flatness import TILE
from .pair_list import bound_cells, find_near_tiles, gap_squared

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
def _first(x, rows, columns, cells, tile_pairs, least):  # type: ignore[no-untyped-def]
    """Return the cells of two features that touch or intersect, or -1 and -1."""
    across = (columns + TILE - 1) // TILE
    edges, corners = np.empty((2, 3, 2), np.int64), np.empty((2, 2, 3), np.int64)
    for pair in range(len(tile_pairs)):
        s, t = tile_pairs[pair, 0], tile_pairs[pair, 1]
        for r in range(s // across * TILE, min((s // across + 1) * TILE, rows - 1)):
            for c in range(s % across * TILE, min((s % across + 1) * TILE, columns - 1)):
                a = r * columns + c
                for q in range(t // across * TILE, min((t // across + 1) * TILE, rows - 1)):
                    for d in range(t % across * TILE, min((t % across + 1) * TILE, columns - 1)):
                        b = q * columns + d
                        if (s == t and b < a) or gap_squared(cells, a, cells, b) > least * least:
                            continue
                        for n, cell in enumerate((a, b)):
                            right, below = cell + 1, cell + columns
                            # All edges of the cell: those at the end of a row belong to no other.
                            for k, (i, j) in enumerate(
                                ((cell, right), (cell, below), (right, below))
                            ):
                                edges[n, k, 0], edges[n, k, 1] = i, j
                            for k, i in enumerate((cell, below + 1)):
                                corners[n, k, 0] = i
                                corners[n, k, 1], corners[n, k, 2] = right, below
                        if _touch(x, edges, corners, least):
                            return a, b
    return -1, -1


@exact_inlined
def _touch(x, edges, corners, least):  # type: ignore[no-untyped-def]
    """Return whether two cells touch or intersect."""
    for n in range(2):
        for m in range(2):
            i, j, k = corners[n, m, 0], corners[n, m, 1], corners[n, m, 2]
            for e in range(3):
                p, q = edges[1 - n, e, 0], edges[1 - n, e, 1]
                if p != i and p != j and p != k:
                    if closest(x, False, p, i, j, k)[0] < least:
                        return True
                    if q != i and q != j and q != k and _pierces(x, p, q, i, j, k, least):
                        return True
    for m in range(3):
        for e in range(3):
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
    x = np.ascontiguousarray(np.moveaxis(positions, 0, -1).reshape(-1, 3), float)
    down, across = -(-rows // TILE), -(-columns // TILE)
    cells, tiles = np.empty((rows * columns, 6)), np.empty((down * across, 6))
    bound_cells(x, x, rows, columns, cells, tiles)
    least, flat = TOUCHING * thickness, np.zeros(down * across, np.int64)
    pairs: Array = np.empty((0, 2), np.int64)
    count, _ = find_near_tiles(tiles, across, flat, least, pairs)
    pairs = np.empty((count, 2), np.int64)
    find_near_tiles(tiles, across, flat, least, pairs)
    a, b = _first(x, rows, columns, cells, pairs, least)
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
