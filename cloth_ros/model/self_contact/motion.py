"""
How far particles have moved since they were at positions of reference, and how edges have changed.

Motion that all particles have in common does not count.
"""

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
def _row_motion(first, last, begin, count, x, y, z, motions, out):  # type: ignore[no-untyped-def]
    for c in range(np.uint64(count)):
        u = last[0, begin + c] - first[0, begin + c] - x
        v = last[1, begin + c] - first[1, begin + c] - y
        w = last[2, begin + c] - first[2, begin + c] - z
        motions[out + c] = np.sqrt(u * u + v * v + w * w) * motions.dtype.type(_ROUNDING)


@inlined
def _row_change(edges, last, begin, count, step, changes, out):  # type: ignore[no-untyped-def]
    """Note the change of the vectors from the particles of a row to those a step away."""
    for c in range(np.uint64(count)):
        i, j = begin + c, begin + step + c
        u = last[0, j] - last[0, i] - edges[0, i]
        v = last[1, j] - last[1, i] - edges[1, i]
        w = last[2, j] - last[2, i] - edges[2, i]
        changes[out + c] = np.sqrt(u * u + v * v + w * w) * changes.dtype.type(_ROUNDING)


@inlined
def _row_of_cells(motions, above, below, out, begin, last):  # type: ignore[no-untyped-def]
    """Write the greatest of the motions at the corners of the cells of a row."""
    for c in range(np.uint64(last)):
        i, j = above + c, below + c
        p, q = motions[i], motions[i + np.uint64(1)]
        r, s = motions[j], motions[j + np.uint64(1)]
        p, r = (p if p > q else q), (r if r > s else s)
        out[begin + c] = p if p > r else r


@inlined
def _row_of_edges(along, across, above, below, out, last):  # type: ignore[no-untyped-def]
    """Write the greatest of the changes of the sides of the cells of a row."""
    for c in range(np.uint64(last)):
        i, j = above + c, below + c
        p, q = along[i], along[j]
        r, s = across[i], across[i + np.uint64(1)]
        p, r = (p if p > q else q), (r if r > s else s)
        out[i] = p if p > r else r


@kernel
def _measure(  # type: ignore[no-untyped-def]
    first, edges_along, edges_across, last, edges, begin, stride, rows, columns, scratch, mean,
    motions, changes,
):  # fmt: skip
    mean[:] = 0.0
    for row in range(rows):
        _add_row(mean, first, last, np.uint64(begin + row * stride), columns)
    number = motions.dtype.type
    for axis in range(3):
        mean[axis] /= rows * columns
    x, y, z = number(mean[0]), number(mean[1]), number(mean[2])
    moved, along, across = scratch[0], scratch[1], scratch[2]
    for row in range(rows):
        start, out = np.uint64(begin + row * stride), np.uint64(row * columns)
        _row_motion(first, last, start, columns, x, y, z, moved, out)
        if edges:
            _row_change(edges_along, last, start, columns - 1, np.uint64(1), along, out)
            if row + 1 < rows:
                _row_change(edges_across, last, start, columns, np.uint64(stride), across, out)
    end = np.uint64(columns - 1)
    for row in range(rows):
        above = np.uint64(row * columns)
        below = np.uint64(min(row + 1, rows - 1) * columns)
        _row_of_cells(moved, above, below, motions, above, columns - 1)
        motions[above + end] = max(moved[above + end], moved[below + end])
        if edges:
            _row_of_edges(along, across, above, below, changes, columns - 1)
            changes[above + end] = across[above + end]
    farthest = number(0)
    for n in range(np.uint64(len(moved))):
        farthest = moved[n] if moved[n] > farthest else farthest
    # Not finite if one of them is not.
    return farthest + (farthest + mean[0] + mean[1] + mean[2]) * 0.0


@kernel
def refer(position, mean, cells, begin, stride, rows, columns, first):  # type: ignore[no-untyped-def]
    """
    Let the motion of some cells be measured from these positions, as far as they are theirs alone.

    Particles of other cells are still measured from where they were.

    Parameters
    ----------
    position
        m, a flat array.
    mean
        Of the motion until there, m, shape (3,), from `measure`.
    cells
        True for the cells: bool, shape (rows * columns,).
    begin, stride, rows, columns
        Layout of flat arrays.
    first
        Receives what `measure` takes.

    """
    for row in range(rows):
        above = max(row - 1, 0)
        for column in range(columns):
            left, i = max(column - 1, 0), np.uint64(begin + row * stride + column)
            if (
                cells[np.uint64(above * columns + left)]
                and cells[np.uint64(above * columns + column)]
                and cells[np.uint64(row * columns + left)]
                and cells[np.uint64(row * columns + column)]
            ):
                for axis in range(3):
                    first[axis, i] = position[axis, i] - first.dtype.type(mean[axis])


def measure(
    first: Array,
    last: Array,
    layout: tuple[int, ...],
    scratch: Array,
    mean: Array,
    motions: Array,
    edges: tuple[Array, Array] | None = None,
    changes: Array | None = None,
) -> float:
    """
    Return how far particles have moved, m; NaN if that is not finite.

    Parameters
    ----------
    first, last
        Flat arrays of positions, m.
    layout
        Begin, stride, rows and columns.
    scratch
        Zeros at first: shape (3, rows * columns), in the precision of the positions.
    mean
        Receives the mean displacement, m, shape (3,), beyond which motion counts.
    motions
        Receives, of each cell, how far its particles have moved, m, shape (rows * columns,).
        Each particle begins a cell; those of the last row and column are lines.
    edges
        The vectors from particles to the next ones in their row, and in their column, that count
        as unchanged, m, flat arrays.  Without them, sides of cells are not looked at.
    changes
        Receives how much the sides of each cell have changed, m, shape (rows * columns,).

    """
    along, across = edges or (first, first)
    wanted = motions if changes is None else changes
    moved: float = _measure(
        first, along, across, last, edges is not None, *layout, scratch, mean, motions, wanted
    )
    return moved if moved < math.inf else math.nan


def write_edges(position: Array, layout: tuple[int, ...], edges: tuple[Array, Array]) -> None:
    """Write the vectors to the next particles, m, as `measure` takes them, for flat arrays."""
    begin, stride, rows, _ = layout
    end = begin + rows * stride
    for out, step in zip(edges, (1, stride), strict=True):
        out[:, begin:end] = position[:, begin + step : end + step] - position[:, begin:end]
