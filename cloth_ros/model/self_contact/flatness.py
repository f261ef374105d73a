"""
Parts of the sheet that are too flat to touch themselves.

A block of tiles whose edges all point nearly the same way cannot touch itself.  With the unit
vectors u along the rows and v along the columns of a block, orthogonal to each other, let a be
the least component of its edges along their own direction, and b the greatest along the other.
Two points that are p cells apart along the rows and q along the columns are then
(a p - b q, a q - b p) apart at least along u and v, by the mean value theorem.
"""

from __future__ import annotations

import math

import numpy as np

from ..kernels.jit import exact, exact_inlined, inlined, kernel

# Cells along a side of a tile.
TILE = 4
# Features that share no particle are half a cell apart at least, along rows and columns both, or
# a whole cell along either.
_NEAREST = math.sqrt(0.5)
# Columns of a frame: the vectors u and v of the block around a tile.
FRAME = 6


@inlined
def _extend(low, high, position, axis, first, step, count):  # type: ignore[no-untyped-def]
    """Extend bounds, by column, by the vectors from particles of a row to others a step away."""
    for c in range(np.uint64(count)):
        e = position[axis, first + step + c] - position[axis, first + c]
        # Not `min`, which would have to propagate NaN: such a loop stays scalar.
        low[c] = e if e < low[c] else low[c]
        high[c] = e if e > high[c] else high[c]


@kernel
def bound_edges(position, begin, stride, rows, columns, bounds, edges, clear):  # type: ignore[no-untyped-def]
    """
    Write the bounds of the edge vectors of each tile, along the rows and along the columns.

    Parameters
    ----------
    position, begin, stride, rows, columns
        Flat array, m, and its layout.
    bounds
        Scratch: shape (2, columns), in the precision of the positions.
    edges
        Receives the least and the greatest vector, m: shape (2, tiles, 6).
    clear
        False to extend the bounds that are there.

    """
    across = (columns + TILE - 1) // TILE
    far = bounds.dtype.type(1e30)
    low, high = bounds[0], bounds[1]
    for band in range((rows + TILE - 1) // TILE):
        top, bottom = band * TILE, min((band + 1) * TILE, rows - 1)
        for n in range(2):
            for axis in range(3):
                low[:] = far
                high[:] = -far
                for row in range(top, bottom + 1 - n):
                    first = np.uint64(begin + row * stride)
                    step = np.uint64(stride if n else 1)
                    _extend(low, high, position, axis, first, step, columns - 1 + n)
                for place in range(across):
                    tile = band * across + place
                    least, most = edges[n, tile, axis], edges[n, tile, 3 + axis]
                    if clear:
                        least, most = np.inf, -np.inf
                    # The edges along the columns at the right of a tile belong to it as well.
                    for c in range(place * TILE, min((place + 1) * TILE, columns - 1) + n):
                        least, most = min(least, low[c]), max(most, high[c])
                    edges[n, tile, axis], edges[n, tile, 3 + axis] = least, most


@exact_inlined
def _block(edges, tile, down, across, box):  # type: ignore[no-untyped-def]
    """Write the bounds of the edges of a tile and its neighbours."""
    row, column = tile // across, tile % across
    for axis in range(3):
        box[:, axis], box[:, 3 + axis] = np.inf, -np.inf
    for r in range(max(row - 1, 0), min(row + 2, down)):
        for c in range(max(column - 1, 0), min(column + 2, across)):
            for n in range(2):
                for axis in range(3):
                    box[n, axis] = min(box[n, axis], edges[n, r * across + c, axis])
                    box[n, 3 + axis] = max(box[n, 3 + axis], edges[n, r * across + c, 3 + axis])


@exact_inlined
def _component(box, n, x, y, z):  # type: ignore[no-untyped-def]
    """Return the middle and the half width of the bounds of a component of edges."""
    middle = 0.5 * (
        x * (box[n, 0] + box[n, 3]) + y * (box[n, 1] + box[n, 4]) + z * (box[n, 2] + box[n, 5])
    )
    half = 0.5 * (
        abs(x) * (box[n, 3] - box[n, 0])
        + abs(y) * (box[n, 4] - box[n, 1])
        + abs(z) * (box[n, 5] - box[n, 2])
    )
    return middle, half


@exact_inlined
def _least_distance(box, frame, tile):  # type: ignore[no-untyped-def]
    """Return the least distance, m, of features of a block that share no particle."""
    u = (frame[tile, 0], frame[tile, 1], frame[tile, 2])
    v = (frame[tile, 3], frame[tile, 4], frame[tile, 5])
    own, half_own = _component(box, 0, u[0], u[1], u[2])
    other, half_other = _component(box, 1, v[0], v[1], v[2])
    along = min(own - half_own, other - half_other)
    own, half_own = _component(box, 0, v[0], v[1], v[2])
    other, half_other = _component(box, 1, u[0], u[1], u[2])
    across = max(abs(own) + half_own, abs(other) + half_other)
    return _NEAREST * (along - across)


@exact
def find_flat(edges, down, across, least, frame, flat):  # type: ignore[no-untyped-def]
    """
    Mark the tiles whose block is flat, and choose the vectors u and v of each.

    Parameters
    ----------
    edges
        From `bound_edges`.
    down, across
        Number of tiles along the columns and along the rows.
    least
        Distance, m, of features in a block that counts as flat.
    frame
        Receives u and v, shape (tiles, FRAME).
    flat
        Receives 1 for a flat block, else 0; shape (tiles,).

    Returns
    -------
    float
        By how much the distances in flat blocks exceed `least` everywhere, m.

    """
    box, slack = np.empty((2, 6)), np.inf
    for tile in range(down * across):
        _block(edges, tile, down, across, box)
        ux, uy, uz = box[0, 0] + box[0, 3], box[0, 1] + box[0, 4], box[0, 2] + box[0, 5]
        vx, vy, vz = box[1, 0] + box[1, 3], box[1, 1] + box[1, 4], box[1, 2] + box[1, 5]
        length = np.sqrt(ux * ux + uy * uy + uz * uz)
        flat[tile] = 0
        if not length > 0.0:
            continue
        ux, uy, uz = ux / length, uy / length, uz / length
        common = ux * vx + uy * vy + uz * vz
        vx, vy, vz = vx - common * ux, vy - common * uy, vz - common * uz
        length = np.sqrt(vx * vx + vy * vy + vz * vz)
        if not length > 0.0:
            continue
        frame[tile, 0], frame[tile, 1], frame[tile, 2] = ux, uy, uz
        frame[tile, 3], frame[tile, 4], frame[tile, 5] = vx / length, vy / length, vz / length
        distance = _least_distance(box, frame, tile)
        if distance > least:
            flat[tile] = 1
            slack = min(slack, distance - least)
    return slack


@exact
def still_flat(edges, down, across, least, frame, flat):  # type: ignore[no-untyped-def]
    """Return the same for tiles that `find_flat` has marked; negative if one is not flat now."""
    box, slack = np.empty((2, 6)), np.inf
    for tile in range(down * across):
        if flat[tile]:
            _block(edges, tile, down, across, box)
            distance = _least_distance(box, frame, tile) - least
            if not distance > 0.0:
                return -1.0
            slack = min(slack, distance)
    return slack
