"""How far the particles of a sheet have moved, apart from a motion that all have in common."""

from __future__ import annotations

import math

import numpy as np

from ..grid import Array
from ..kernels.jit import inlined, kernel

# Rounding of sums in single precision.
_ROUNDING = 1.001


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
        lanes[c] = squared if squared > lanes[c] else lanes[c]


@kernel
def _farthest(first, last, begin, stride, rows, columns, lanes, mean):  # type: ignore[no-untyped-def]
    mean[:] = 0.0
    for row in range(rows):
        _add_row(mean, first, last, np.uint64(begin + row * stride), columns)
    number = lanes.dtype.type
    for axis in range(3):
        mean[axis] /= rows * columns
    x, y, z = number(mean[0]), number(mean[1]), number(mean[2])
    lanes[:] = 0
    for row in range(rows):
        _row_maximum(first, last, np.uint64(begin + row * stride), columns, x, y, z, lanes)
    most = 0.0
    for c in range(columns):
        most = max(most, lanes[c])
    return most


def farthest(
    first: Array, last: Array, layout: tuple[int, ...], lanes: Array, mean: Array
) -> float:
    """
    Return the greatest displacement of a particle beyond the mean of all, m; NaN if not finite.

    Parameters
    ----------
    first, last
        Flat arrays of positions, m.
    layout
        Begin, stride, rows and columns.
    lanes
        Scratch: shape (columns,), in the precision of the positions.
    mean
        Receives the mean displacement, m, shape (3,).

    """
    squared = _farthest(first, last, *layout, lanes, mean)
    total = squared + mean.sum()  # not finite if one of them is not
    return math.sqrt(squared) * _ROUNDING if math.isfinite(total) else math.nan
