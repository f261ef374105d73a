"""
Broad phase of contact: the part of the sheet that a sphere may touch in a substep.

Where the sphere is far from the whole sheet, its clearance is counted down, and nothing else is
done.  Elsewhere the whole sheet is searched for candidates, cells within some margin of the
sphere, which remain valid until motion has used up the margin: a Verlet list (L. Verlet,
"Computer 'Experiments' on Classical Fluids", Physical Review 159, 1967).  Each substep compares
the bounds of the candidates alone, and lists the particles and triangles of those in reach.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..grid import Array, Grid
from ..kernels.jit import exact, exact_subroutine, reduction
from ..state import State

# Substeps at present speeds for which candidates remain valid.  Fewer where that takes a margin of
# more than the radius of the sphere, which would make too many candidates.
_LIFETIME = 16
# Factor by which the margin may exceed what present speeds need: where motion has slowed down,
# fewer candidates are enough, and a clearance may have opened.
_WIDE = 4.0
# Greatest decrease of the distance of two boxes whose corners move along different axes, as a
# multiple of their displacement.
_AXES = math.sqrt(3.0)


@reduction
def _row_bounds(position, first, columns, out):  # type: ignore[no-untyped-def]
    """Write the bounds of a row, low x y z, then high x y z."""
    for axis in range(3):
        low, high = position[axis, first], position[axis, first]
        for i in range(np.uint64(first), np.uint64(first + columns)):
            low = min(low, position[axis, i])
            high = max(high, position[axis, i])
        out[axis], out[3 + axis] = low, high


@exact_subroutine
def _distance(bounds, start, end):  # type: ignore[no-untyped-def]
    """Return the distance of a box, low x y z, then high x y z, from that of a path."""
    total = 0.0
    for axis in range(3):
        low, high = min(start[axis], end[axis]), max(start[axis], end[axis])
        apart = max(bounds[axis] - high, low - bounds[3 + axis], 0.0)
        total += apart * apart
    return np.sqrt(total)


@exact_subroutine
def _cell_bounds(bounds, position, velocity, i, down, across, h):  # type: ignore[no-untyped-def]
    """Write the bounds of a cell over the `h` s that have just ended."""
    for axis in range(3):
        bounds[axis], bounds[3 + axis] = np.inf, -np.inf
        for n in range(4):
            j = i + (n % 2) * across + (n // 2) * down
            after = np.float64(position[axis, j])
            before = after - h * np.float64(velocity[axis, j])
            bounds[axis] = min(bounds[axis], before, after)
            bounds[3 + axis] = max(bounds[3 + axis], before, after)


@exact
def _search(  # type: ignore[no-untyped-def]
    position, velocity, begin, stride, rows, columns, start, end, reach, cells
):
    """
    Find the cells that are now in reach of the path of the sphere's centre.

    Parameters
    ----------
    position, velocity
        Flat arrays.
    start, end
        Of the path, m, shape (3,).
    reach
        m.
    cells
        Receives row × columns + column of each cell found.

    Returns
    -------
    (int, float)
        Number of cells found, and the least distance from the path to any row, m.

    """
    down, across = min(rows - 1, 1), min(columns - 1, 1)
    bounds = np.empty((2, 6))
    single = np.empty(6, position.dtype)
    merged = np.empty(6)
    count, nearest = 0, np.inf
    _row_bounds(position, begin, columns, single)
    for k in range(6):
        bounds[0, k] = single[k]
    for row in range(max(rows - 1, 1)):
        upper, lower = row % 2, (row + down) % 2
        _row_bounds(position, begin + (row + down) * stride, columns, single)
        for k in range(6):
            bounds[lower, k] = single[k]
        for axis in range(3):
            merged[axis] = min(bounds[upper, axis], bounds[lower, axis])
            merged[3 + axis] = max(bounds[upper, 3 + axis], bounds[lower, 3 + axis])
        distance = _distance(merged, start, end)
        nearest = min(nearest, distance)
        if distance > reach:
            continue
        for column in range(max(columns - 1, 1)):
            i = begin + row * stride + column
            _cell_bounds(merged, position, velocity, i, down * stride, across, 0.0)
            if _distance(merged, start, end) <= reach:
                cells[count] = row * columns + column
                count += 1
    return count, nearest


@exact
def _gather(  # type: ignore[no-untyped-def]
    position, velocity, begin, stride, rows, columns, h, start, end, reach, cells, particles,
    triangles, local,
):  # fmt: skip
    """
    List the particles and the triangles of the candidates in reach.

    Parameters
    ----------
    position, velocity, begin, stride, rows, columns, start, end
        As in `_search`.
    h
        Length of the substep that has just ended, s.
    reach
        m; a cell is in reach if it, or the sphere, was at any time in the substep.
    cells
        The candidates.
    particles
        Receives the flat index of each particle once.
    triangles
        Receives their corners as indices into these particles, int64, shape (4 × cells, 3).
    local
        Scratch, shape (size,), all -1 before and after.

    Returns
    -------
    (int, int)
        Number of particles, and of triangles.

    """
    down, across = min(rows - 1, 1), min(columns - 1, 1)
    whole = down + across == 2
    bounds = np.empty(6)
    corner = np.empty(4, np.int64)
    number, count = 0, 0
    for n in range(len(cells)):
        i = begin + cells[n] // columns * stride + cells[n] % columns
        _cell_bounds(bounds, position, velocity, i, down * stride, across, h)
        if _distance(bounds, start, end) > reach:
            continue
        for k in range(4):
            j = i + (k // 2) * down * stride + (k % 2) * across
            if local[j] < 0:
                local[j] = number
                particles[number] = j
                number += 1
            corner[k] = local[j]
        if whole:
            for k in range(4):  # each triangle leaves out one corner
                triangles[count, 0] = corner[(k + 1) % 4]
                triangles[count, 1] = corner[(k + 2) % 4]
                triangles[count, 2] = corner[(k + 3) % 4]
                count += 1
        else:
            triangles[count, 0] = corner[0]
            triangles[count, 1] = corner[3]
            triangles[count, 2] = corner[3]
            count += 1
    for n in range(number):
        local[particles[n]] = -1
    return number, count


class Candidates(NamedTuple):
    """
    Cells that may be in reach, and for how long.

    Attributes
    ----------
    cells
        row × columns + column of each, shape (n,).
    clearance, margin
        m, see `BroadPhase`.

    """

    cells: Array
    clearance: float
    margin: float


class BroadPhase:
    """
    Finds the part of a sheet that a sphere may touch.

    Attributes
    ----------
    clearance
        Distance, m, by which sphere and sheet can still approach each other without a touch; 0
        or less if it is unknown.

    """

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        cells = max(grid.rows - 1, 1) * max(grid.columns - 1, 1)
        self._cells = np.empty(cells, np.int32)
        self._particles = np.empty(grid.rows * grid.columns, np.int32)
        self._local = np.full(grid.size, -1, np.int32)
        self._count = 0
        self._near = False  # no kernel is called before the sphere is near for the first time
        self.invalidate()

    def invalidate(self) -> None:
        """Discard the candidates: sheet or sphere were moved from outside."""
        self.clearance, self._margin = 0.0, -math.inf

    def reduce_clearance(self, approach: float) -> None:
        """Account for an approach of sphere and sheet of up to `approach`, m."""
        self.clearance -= approach
        self._margin -= approach

    def is_clear(self, approach: float) -> bool:
        """
        Return whether sphere and sheet stay apart during an approach of `approach`, m.

        The candidates are then discarded: they are not updated during that approach.
        """
        clear = self.clearance > approach  # False for NaN
        if clear:
            self._margin = -math.inf
        return clear

    def distance(self, state: State, start: Array, end: Array) -> float:
        """
        Return the least distance of a path from any row of the sheet, m, as `_search` does.

        In NumPy: it decides whether contact is possible before kernels of contact are compiled.

        Parameters
        ----------
        state
            The sheet.
        start, end
            Of the path, relative to the origin of the state, m, shape (3,).

        """
        sheet = self._grid.interior(state.position)
        low, high = sheet.min(axis=2).astype(float), sheet.max(axis=2).astype(float)
        if self._grid.rows > 1:  # bounds of all cells between two rows
            low, high = np.minimum(low[:, 1:], low[:, :-1]), np.maximum(high[:, 1:], high[:, :-1])
        first, last = np.minimum(start, end)[:, None], np.maximum(start, end)[:, None]
        x, y, z = np.maximum(np.maximum(low - last, first - high), 0.0)
        return float(np.sqrt(x * x + y * y + z * z).min())

    def candidates(self) -> Candidates:
        """Return the present candidates."""
        return Candidates(self._cells[: self._count].copy(), self.clearance, self._margin)

    def restore(self, candidates: Candidates) -> None:
        """Return to former candidates of the same sheet in the same state."""
        self._count = len(candidates.cells)
        self._cells[: self._count], self.clearance, self._margin = candidates

    def find(
        self, state: State, h: float, start: Array, end: Array, radius: float, approach: float
    ) -> tuple[Array, Array]:
        """
        Return the particles that the sphere may touch on its path, and their triangles.

        Parameters
        ----------
        state
            After the substep.
        h
            Length of the substep, s.
        start, end, radius
            Path of the sphere's centre in the substep, relative to the origin of the state, and
            its radius, m.
        approach
            Distance, m, by which sphere and sheet may have approached each other in the substep,
            already accounted for.  A push by the sphere may move particles by as much again.

        Returns
        -------
        (array, array)
            Flat index of each particle, shape (n,), and the corners of the triangles as indices
            into these, shape (m, 3); a segment, or a point, has equal corners.

        """
        grid = self._grid
        layout = (grid.begin, grid.stride, grid.rows, grid.columns)
        fields = (state.position, state.velocity)
        margin = approach + min(_LIFETIME * approach, radius)
        if not approach <= self._margin <= _WIDE * margin:  # True for NaN
            reach = radius + _AXES * (approach + margin)
            self._count, nearest = 0, 0.0 if self._near else self.distance(state, start, end)
            if not nearest > reach:  # True for NaN
                self._near = True
                self._count, nearest = _search(*fields, *layout, start, end, reach, self._cells)
            self.clearance, self._margin = nearest - radius, margin
        triangles = np.empty((4 * self._count, 3), np.int64)
        if not self._count:
            return self._particles[:0], triangles
        number, count = _gather(
            *fields, *layout, h, start, end, radius + approach, self._cells[: self._count],
            self._particles, triangles, self._local,
        )  # fmt: skip
        return self._particles[:number], triangles[:count]
