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


@inlined
def _add_row(sums, first, last, begin, count):  # type: ignore[no-untyped-def]
    for axis in range(np.uint64(3)):
        total = first[axis, begin] - first[axis, begin]
        for c in range(np.uint64(count)):
            total += last[axis, begin + c] - first[axis, begin + c]
        sums[axis] += total


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
def _measure(first, last, edges, begin, stride, rows, columns, lanes, mean):  # type: ignore[no-untyped-def]
    mean[:] = 0.0
    for row in range(rows):
        _add_row(mean, first, last, np.uint64(begin + row * stride), columns)
    number = lanes.dtype.type
    for axis in range(3):
        mean[axis] /= rows * columns
    x, y, z = number(mean[0]), number(mean[1]), number(mean[2])
    lanes[:] = 0
    for row in range(rows):
        start = np.uint64(begin + row * stride)
        _row_maximum(first, last, start, columns, x, y, z, lanes)
        if edges:
            _edge_maximum(first, last, start, columns - 1, np.uint64(1), lanes)
            if row + 1 < rows:
                _edge_maximum(first, last, start, columns, np.uint64(stride), lanes)
    moved, changed = 0.0, 0.0
    for c in range(columns):
        moved = max(moved, lanes[0, c])
        changed = max(changed, lanes[1, c])
    # Not finite if one of them is not.
    finite = (moved + mean[0] + mean[1] + mean[2]) * 0.0
    return np.sqrt(moved) * _ROUNDING + finite, np.sqrt(changed) * _ROUNDING + finite


def measure(
    first: Array, last: Array, edges: bool, layout: tuple[int, ...], lanes: Array, mean: Array
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
    mean
        Receives the mean displacement, m, shape (3,), beyond which motion counts.

    """
    moved, changed = _measure(first, last, edges, *layout, lanes, mean)
    return (moved, changed) if moved < math.inf else (math.nan, math.nan)
