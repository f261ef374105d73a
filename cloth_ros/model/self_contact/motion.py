"""How far the particles of a sheet have moved, apart from a motion that all have in common."""

from __future__ import annotations

import math

import numpy as np

from ..grid import Array
from ..kernels.jit import inlined, kernel

# Rounding of sums in single precision.
_ROUNDING = 1.001
# Lanes: motion of particles, and change of edges.
LANES = 2
# Cells along a side of a tile, for which motion is found.
TILE = 8
# Particles along a side, of which the median motion is taken.
_SAMPLES = 5


@inlined
def _median_motion(first, last, begin, stride, rows, columns, common):  # type: ignore[no-untyped-def]
    """Write the median displacement of some particles: that of most, if others move."""
    values = np.empty(_SAMPLES * _SAMPLES)
    for axis in range(3):
        count = 0
        for r in range(_SAMPLES):
            for c in range(_SAMPLES):
                row = (2 * r + 1) * rows // (2 * _SAMPLES)
                i = begin + row * stride + (2 * c + 1) * columns // (2 * _SAMPLES)
                value = np.float64(last[axis, i] - first[axis, i])
                place = count
                while place > 0 and values[place - 1] > value:
                    values[place] = values[place - 1]
                    place -= 1
                values[place] = value
                count += 1
        common[axis] = values[count // 2]


@inlined
def _row_maximum(first, last, begin, count, x, y, z, lanes):  # type: ignore[no-untyped-def]
    for c in range(np.uint64(count)):
        u = last[0, begin + c] - first[0, begin + c] - x
        v = last[1, begin + c] - first[1, begin + c] - y
        w = last[2, begin + c] - first[2, begin + c] - z
        squared = u * u + v * v + w * w
        lanes[0, c] = squared if squared > lanes[0, c] else lanes[0, c]


@inlined
def _edge_maximum(first, last, begin, count, step, lanes):  # type: ignore[no-untyped-def]
    """Note the change of the vectors from the particles of a row to those a step away."""
    for c in range(np.uint64(count)):
        i, j = begin + c, begin + step + c
        u = (last[0, j] - first[0, j]) - (last[0, i] - first[0, i])
        v = (last[1, j] - first[1, j]) - (last[1, i] - first[1, i])
        w = (last[2, j] - first[2, j]) - (last[2, i] - first[2, i])
        squared = u * u + v * v + w * w
        lanes[1, c] = squared if squared > lanes[1, c] else lanes[1, c]


@kernel
def _measure(  # type: ignore[no-untyped-def]
    first, last, edges, begin, stride, rows, columns, lanes, common, tiles
):
    _median_motion(first, last, begin, stride, rows, columns, common)
    number = lanes.dtype.type
    x, y, z = number(common[0]), number(common[1]), number(common[2])
    lanes[1, :] = 0
    across = (columns + TILE - 1) // TILE
    moved, changed = 0.0, 0.0
    for band in range((rows + TILE - 1) // TILE):
        lanes[0, :] = 0
        top, bottom = band * TILE, min((band + 1) * TILE, rows - 1)
        for row in range(top, bottom + 1):
            start = np.uint64(begin + row * stride)
            _row_maximum(first, last, start, columns, x, y, z, lanes)
            if edges and (row < bottom or row + 1 == rows):
                _edge_maximum(first, last, start, columns - 1, np.uint64(1), lanes)
                if row + 1 < rows:
                    _edge_maximum(first, last, start, columns, np.uint64(stride), lanes)
        for place in range(across):
            # The particles at the ends of a tile belong to the next one as well.
            most = 0.0
            for c in range(place * TILE, min((place + 1) * TILE, columns - 1) + 1):
                most = max(most, lanes[0, c])
            tiles[band * across + place] = np.sqrt(most) * _ROUNDING
            moved = max(moved, most)
    for c in range(columns):
        changed = max(changed, lanes[1, c])
    # Not finite if one of them is not.
    finite = (moved + common[0] + common[1] + common[2]) * 0.0
    return np.sqrt(moved) * _ROUNDING + finite, np.sqrt(changed) * _ROUNDING + finite


def measure(
    first: Array,
    last: Array,
    edges: bool,
    layout: tuple[int, ...],
    lanes: Array,
    common: Array,
    tiles: Array,
) -> tuple[float, float]:
    """
    Return how far particles have moved, and how much edges have changed, m; NaN if not finite.

    Parameters
    ----------
    first, last
        Flat arrays of positions, m.
    edges
        False: without the change of edges, which is 0 then.
    layout
        Begin, stride, rows and columns.
    lanes
        Scratch: shape (LANES, columns), in the precision of the positions.
    common
        Receives the displacement, m, shape (3,), beyond which motion counts.
    tiles
        Receives how far particles of each tile of cells have moved, m.

    """
    moved, changed = _measure(first, last, edges, *layout, lanes, common, tiles)
    return (moved, changed) if moved < math.inf else (math.nan, math.nan)
