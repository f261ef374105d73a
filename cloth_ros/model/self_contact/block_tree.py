"""
Pairs of cells of the sheet that may touch each other, by a tree of square blocks of cells.

Blocks of 1, 2, 4, … cells along a side have bounds of their particles and of their edge vectors.
From the whole sheet downwards, a block is not paired with itself, nor with a neighbour, where both
together are so flat that they cannot touch; other blocks are not paired where their bounds are out
of reach of each other.  What remains are pairs of cells.

So that the pairs stay complete while particles move, relative motion is allowed for in two ways:
particles that are K cells apart in the sheet, along rows and columns together, do not move farther
relative to each other than K times the greatest change of an edge between them, nor than the
margins of their cells together.

The order of the pairs is that of the tree, whatever the positions are: results that depend on the
order do not depend on when a list was made.
"""

from __future__ import annotations

import numpy as np

from ..grid import Array
from ..kernels.jit import exact, exact_inlined, inlined, kernel
from .flatness import EDGES, least_distance

# Rows of the bounds: least and greatest coordinates, then those of the edge vectors along the rows
# and along the columns.
_EDGES = 6
_BOUNDS = _EDGES + EDGES
# Rows and columns of blocks from one to another up to which both may be flat together.
_LARGEST = 2
# The same, up to which the change of edges from one to the other is looked up.
_ALONG = 6
# Pairs of blocks that are still to be compared: at most 15 more on each level.
_STACK = 16 * 12


class Blocks:
    """
    Bounds of the blocks of a sheet.

    Parameters
    ----------
    rows, columns
        Of the sheet, 2 at least.  Each particle begins a cell; those of the last row and column
        are counted to the cell before them.
    dtype
        Of the positions.

    Attributes
    ----------
    bounds
        Of all blocks, m, shape (18, blocks); cells first, row by row, then larger blocks.
    margins
        Of all blocks, m, shape (2, blocks): how far their particles may move, and how much their
        edges may change.
    chosen
        True for blocks with a chosen cell: bool, shape (blocks,).
    levels
        First block, rows and columns of each size, shape (sizes, 3).

    """

    def __init__(self, rows: int, columns: int, dtype: type) -> None:
        levels = [(0, rows, columns)]
        while levels[-1][1:] != (1, 1):
            first, down, across = levels[-1]
            levels.append((first + down * across, (down + 1) // 2, (across + 1) // 2))
        self.levels: Array = np.array(levels)
        self.bounds: Array = np.empty((_BOUNDS, levels[-1][0] + 1), dtype)
        self.margins: Array = np.zeros((2, levels[-1][0] + 1))
        self.chosen: Array = np.zeros(levels[-1][0] + 1, np.bool_)

    def bound(self, position: Array, begin: int, stride: int, *, extend: bool = False) -> None:
        """Bound the cells by positions, m, a flat array, or `extend` their bounds by these."""
        rows, columns = self.levels[0, 1:]
        _bound_cells(position, begin, stride, rows, columns, self.bounds, extend)

    def finish(self) -> None:
        """Bound the larger blocks by the cells."""
        _bound_blocks(self.levels, self.bounds)

    def near_cells(
        self, reach: float, far: float, flat: float, margins: Array, changes: Array, out: Array,
        chosen: Array,
    ) -> int:  # fmt: skip
        """
        List the pairs of cells, at least one of them chosen, that may come into reach.

        Parameters
        ----------
        reach
            Distance, m, up to which features are near.
        far
            The same, m, of cells that are more than two cells apart in the sheet, where `changes`
            decide.
        flat
            Distance, m, of features in a block that counts as flat.
        margins, changes
            Motion of the particles of each cell, and change of its sides, m, for which the list
            stays complete: shape (cells,).
        out
            Receives the cells of each pair, shape (n, 2); pairs beyond its length are counted.
        chosen
            True for chosen cells: bool, shape (cells,).

        Returns
        -------
        int
            Number of pairs.

        """
        self.margins[0, : len(margins)], self.margins[1, : len(changes)] = margins, changes
        self.chosen[: len(chosen)] = chosen
        count: int = _near_cells(
            self.levels, self.bounds, self.margins, self.chosen, reach, far, flat, out
        )
        return count


@inlined
def _bound_coordinates(bounds, axis, position, first, top, below, count, extend):  # type: ignore[no-untyped-def]
    """Extend the bounds of the cells of a row by their corners."""
    for c in range(np.uint64(count)):
        i, j = top + c, below + c
        p, q = position[axis, i], position[axis, i + np.uint64(1)]
        r, s = position[axis, j], position[axis, j + np.uint64(1)]
        # Not `min`, which would have to propagate NaN: such a loop stays scalar.
        low, high = (p if p < q else q), (q if p < q else p)
        low2, high2 = (r if r < s else s), (s if r < s else r)
        low, high = (low if low < low2 else low2), (high2 if high < high2 else high)
        n = first + c
        if extend:
            low = low if low < bounds[axis, n] else bounds[axis, n]
            high = high if high > bounds[axis + 3, n] else bounds[axis + 3, n]
        bounds[axis, n], bounds[axis + 3, n] = low, high


@inlined
def _bound_edges(bounds, low, position, axis, first, top, below, across, count, extend):  # type: ignore[no-untyped-def]
    """Extend the bounds of the edge vectors of the cells of a row, of which each has two."""
    high = low + np.uint64(3)
    for c in range(np.uint64(count)):
        i, j = top + c, below + c
        e = position[axis, i + across] - position[axis, i]
        f = position[axis, j + across] - position[axis, j]
        least, most = (e if e < f else f), (f if e < f else e)
        n = first + c
        if extend:
            least = least if least < bounds[low, n] else bounds[low, n]
            most = most if most > bounds[high, n] else bounds[high, n]
        bounds[low, n], bounds[high, n] = least, most


@kernel
def _bound_cells(position, begin, stride, rows, columns, bounds, extend):  # type: ignore[no-untyped-def]
    one, step = np.uint64(1), np.uint64(stride)
    for row in range(rows - 1):
        first, top = np.uint64(row * columns), np.uint64(begin + row * stride)
        count = columns - 1
        for axis in range(np.uint64(3)):
            _bound_coordinates(bounds, axis, position, first, top, top + step, count, extend)
            along = np.uint64(_EDGES) + axis
            across = along + np.uint64(6)
            _bound_edges(bounds, along, position, axis, first, top, top + step, one, count, extend)
            _bound_edges(
                bounds, across, position, axis, first, top, top + one, step, count, extend
            )
    for n in range(_BOUNDS):
        for row in range(rows - 1):
            last = row * columns + columns - 1
            bounds[n, last] = bounds[n, last - 1]
        for c in range(columns):
            last = (rows - 1) * columns + c
            bounds[n, last] = bounds[n, last - columns]


@inlined
def _combine(bounds, low, first, above, below, right, count):  # type: ignore[no-untyped-def]
    """Bound blocks of a row by those of half their size, two in each of two rows."""
    high = low + np.uint64(3)
    for c in range(np.uint64(count)):
        i, j = above + np.uint64(2) * c, below + np.uint64(2) * c
        p, q, r, s = bounds[low, i], bounds[low, i + right], bounds[low, j], bounds[low, j + right]
        p, r = (p if p < q else q), (r if r < s else s)
        bounds[low, first + c] = p if p < r else r
        p, q, r, s = (
            bounds[high, i], bounds[high, i + right], bounds[high, j], bounds[high, j + right]
        )  # fmt: skip
        p, r = (p if p > q else q), (r if r > s else s)
        bounds[high, first + c] = p if p > r else r


@kernel
def _bound_blocks(levels, bounds):  # type: ignore[no-untyped-def]
    zero, one = np.uint64(0), np.uint64(1)
    for level in range(1, len(levels)):
        start, down, across = levels[level, 0], levels[level, 1], levels[level, 2]
        former, rows, columns = levels[level - 1, 0], levels[level - 1, 1], levels[level - 1, 2]
        for row in range(down):
            first = np.uint64(start + row * across)
            above = np.uint64(former + 2 * row * columns)
            below = np.uint64(former + min(2 * row + 1, rows - 1) * columns)
            whole = columns // 2
            for n in range(_BOUNDS // 6):
                for axis in range(3):
                    low = np.uint64(6 * n + axis)
                    _combine(bounds, low, first, above, below, one, whole)
                    if columns % 2:
                        c = np.uint64(2 * whole)
                        last = first + np.uint64(whole)
                        _combine(bounds, low, last, above + c, below + c, zero, 1)


@exact_inlined
def _gap_squared(bounds, a, b):  # type: ignore[no-untyped-def]
    """Return the squared distance of the bounds of two blocks, m²."""
    total = 0.0
    for axis in range(3):
        gap = max(
            bounds[axis, a] - bounds[axis + 3, b], bounds[axis, b] - bounds[axis + 3, a], 0.0
        )
        total += gap * gap
    return total


@exact_inlined
def _bound_edges_of_blocks(bounds, first, across, top, bottom, left, right, box):  # type: ignore[no-untyped-def]
    """Write the bounds of the edge vectors of a rectangle of blocks."""
    for n in range(EDGES):
        box[n] = bounds[_EDGES + n, first + top * across + left]
    for r in range(top, bottom + 1):
        for c in range(left, right + 1):
            block = first + r * across + c
            for axis in range(3):
                for n in range(axis, EDGES, 6):
                    box[n] = min(box[n], bounds[_EDGES + n, block])
                    box[n + 3] = max(box[n + 3], bounds[_EDGES + n + 3, block])


@exact_inlined
def _combine_margins(levels, margins, chosen):  # type: ignore[no-untyped-def]
    """Write the greatest margins of the cells of larger blocks, and whether one is chosen."""
    for level in range(1, len(levels)):
        start, down, across = levels[level, 0], levels[level, 1], levels[level, 2]
        former, rows, columns = levels[level - 1, 0], levels[level - 1, 1], levels[level - 1, 2]
        for row in range(down):
            above = former + 2 * row * columns
            below = former + min(2 * row + 1, rows - 1) * columns
            for c in range(across):
                left, right = 2 * c, min(2 * c + 1, columns - 1)
                chosen[start + row * across + c] = (
                    chosen[above + left] or chosen[above + right]
                    or chosen[below + left] or chosen[below + right]
                )  # fmt: skip
                for n in range(2):
                    margins[n, start + row * across + c] = max(
                        margins[n, above + left], margins[n, above + right],
                        margins[n, below + left], margins[n, below + right],
                    )  # fmt: skip


@exact_inlined
def _greatest_change(margins, first, across, top, bottom, left, right):  # type: ignore[no-untyped-def]
    """Return how much the edges in a rectangle of blocks may change, m."""
    change = 0.0
    for r in range(top, bottom + 1):
        for c in range(left, right + 1):
            change = max(change, margins[1, first + r * across + c])
    return change


@exact
def _near_cells(levels, bounds, margins, chosen, reach, far, flat, out):  # type: ignore[no-untyped-def]
    _combine_margins(levels, margins, chosen)
    box = np.empty(EDGES)
    # Level, row and column of one block, and of the other.
    stack = np.empty((_STACK, 5), np.int64)
    stack[0, 0], stack[0, 1:] = len(levels) - 1, 0
    count, height = 0, 1
    while height:
        height -= 1
        level, a, b, c, d = (
            stack[height, 0], stack[height, 1], stack[height, 2], stack[height, 3],
            stack[height, 4],
        )  # fmt: skip
        first, across = levels[level, 0], levels[level, 2]
        m, n = np.uint64(first + a * across + b), np.uint64(first + c * across + d)
        if not (chosen[m] or chosen[n]):
            continue
        apart = max(abs(c - a), abs(d - b))
        top, bottom, left, right = min(a, c), max(a, c), min(b, d), max(b, d)
        change = -1.0  # not known yet
        if apart > 1:
            gap = _gap_squared(bounds, m, n)
            allowed = reach + margins[0, m] + margins[0, n]
            if gap > allowed * allowed:
                continue
            if apart <= _ALONG:
                change = _greatest_change(margins, first, across, top, bottom, left, right)
                cells = (bottom - top + right - left + 2) << level
                beside = level == 0 and apart <= 2
                allowed = (reach if beside else far) + cells * change
                if gap > allowed * allowed:
                    continue
        if apart <= _LARGEST:
            if change < 0.0:
                change = _greatest_change(margins, first, across, top, bottom, left, right)
            _bound_edges_of_blocks(bounds, first, across, top, bottom, left, right, box)
            if least_distance(box, 2 * change) > flat:
                continue
        if level == 0:
            if count < len(out):
                out[count, 0], out[count, 1] = a * across + b, c * across + d
            count += 1
            continue
        rows, columns = levels[level - 1, 1], levels[level - 1, 2]
        same = a == c and b == d
        for pair in range(15, -1, -1):  # the first pair is the last that is put on the stack
            i, j = pair // 4, pair % 4
            p, q, r, s = 2 * a + i // 2, 2 * b + i % 2, 2 * c + j // 2, 2 * d + j % 2
            exists = p < rows and q < columns and r < rows and s < columns
            if exists and not (same and j < i):
                stack[height, 0] = level - 1
                stack[height, 1], stack[height, 2] = p, q
                stack[height, 3], stack[height, 4] = r, s
                height += 1
    return count
