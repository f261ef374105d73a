"""Keep a list of the pairs of features that are near each other; renew it when it may miss one."""

from __future__ import annotations

import math

import numpy as np

from ..grid import Array, Grid
from .block_tree import Blocks
from .contact_search import REACH
from .flatness import NEAREST
from .motion import LANES, measure
from .pair_list import bound_features, find_pairs
from .particle_arrays import load_vectors

# Distance of features, in thicknesses, in parts of the sheet that count as flat.
_FLAT = 1.02 * REACH
# Shares of what edges can lose before a flat sheet counts as one that is not flat: by which edges
# may change, at least and at most, until the list is renewed.
_LEAST_CHANGE, _MOST_CHANGE = 0.04, 0.3
# Share by which edges may change more than they have: the vibrations of springs do not grow.
_MORE_CHANGE = 1.5
# Share by which particles may approach each other faster in the next part.
_MORE = 1.2
# Margin of a list for the motion of particles, in thicknesses, at least and at most: the next
# layer but one is out of reach.  And of a short list at most, in spacings.
_LEAST_MARGIN, _MOST_MARGIN, _MOST_IF_SHORT = 0.3, 0.7, 4.0
# Parts for which a list is made, at least, and at most if it is short; in pairs of cells, in units
# of the number of particles.
_PARTS, _PARTS_IF_SHORT, _SHORT = 4, 64, 0.02
_LEAST_ROOM = 256
# Share of a list's length that is added when it is too short.
_GROWTH = 1.3


class Neighbours:
    """
    Pairs of features of a sheet that may come into contact.

    Parameters
    ----------
    grid, dtype
        Of the sheet.
    thickness, spacing
        Of the sheet, and the shortest one of its particles, m.
    foreseen
        Motion, m, in which contact is foreseen.

    Attributes
    ----------
    pairs, normals, distances
        Particles, a unit vector, and a bound of the distance of each pair: see `contact_search`.
    vertices
        Number of pairs, at the beginning, of a vertex and a triangle.
    used
        Particles of these pairs, ascending.
    renewals
        Number of times that the list was renewed.

    """

    def __init__(
        self, grid: Grid, dtype: type, thickness: float, spacing: float, foreseen: float
    ) -> None:
        rows, columns = self._size = (grid.rows, grid.columns)
        self._layout = (grid.begin, grid.stride, rows, columns)
        self._reach, self._far = REACH * thickness, thickness + foreseen
        # Features that are two cells apart must be farther apart than those that are foreseen.
        self._flat = max(_FLAT * thickness, 0.5 * NEAREST * self._far)
        self._spare, self._foreseen = self._reach - thickness, foreseen
        room = spacing - self._flat / NEAREST
        self._changes = (_LEAST_CHANGE * room, _MOST_CHANGE * room)
        self._least_margin = _LEAST_MARGIN * thickness
        self._margins = (_MOST_MARGIN * thickness, _MOST_IF_SHORT * spacing)
        self._blocks = Blocks(rows, columns, dtype)
        self._cells: Array = np.empty((_LEAST_ROOM, 2), np.int64)
        self._boxes = np.empty((6, rows * columns, 6))
        self._bounded = np.zeros(rows * columns, np.bool_)
        self._all = np.arange(rows * columns)
        # Positions at which the list was made, and how far particles have moved and edges have
        # changed since then, m.
        self._listed = grid.field(dtype)
        self._moved, self._changed = 0.0, 0.0
        # By how much more than the least the next list has to reach, m.
        self._more = 0.0
        self._still = grid.field(dtype)
        self._lanes: Array = np.empty((LANES, columns), dtype)
        self.mean = np.zeros(3)
        self._points = np.zeros((2, rows * columns, 3))
        self._parts, self.renewals = _PARTS, 0
        self._arrays = [self._room(_LEAST_ROOM), self._room(_LEAST_ROOM)]
        none: Array = np.zeros(0)
        self._empty: tuple[Array, ...] = (*self._room(0), none, none.astype(np.int64))
        self.invalidate()

    @staticmethod
    def _room(count: int) -> tuple[Array, Array]:
        return np.empty((count, 4), np.uint32), np.empty((count, 3), np.float32)

    def invalidate(self) -> None:
        """Renew the list when it is next needed."""
        self._margin = self._change = -1.0
        self._take([0, 0])

    def _take(self, counts: list[int]) -> None:
        """Make a list of so many pairs of both kinds, which were found."""
        self.vertices, number = counts[0], sum(counts)
        if number == 0:
            self.pairs, self.normals, self.distances, self.used = self._empty
            return
        parts = [
            tuple(array[:count] for array in arrays)
            for arrays, count in zip(self._arrays, counts, strict=True)
        ]
        self.pairs, self.normals = (np.concatenate(both) for both in zip(*parts, strict=True))
        self.distances = np.full(number, -math.inf)
        used = np.zeros(len(self._bounded), np.bool_)
        used[self.pairs] = True
        self.used = np.flatnonzero(used)

    def motion(self, before: Array, now: Array) -> float:
        """Return how far particles have moved, m, beyond the mean; NaN if that is not finite."""
        return self._measure(before, now, edges=False)[0]

    def _measure(self, before: Array, now: Array, *, edges: bool = True) -> tuple[float, float]:
        return measure(before, now, edges, self._layout, self._lanes, self.mean)

    def prepare(self, position: Array, velocity: Array, seconds: float) -> bool:
        """
        Make the list complete for contacts at the start of a part of `seconds`.

        The mean velocity is left in `mean`.

        Parameters
        ----------
        position, velocity
            Flat arrays, m and m/s.

        Returns
        -------
        bool
            Whether the list is a new one.

        """
        ahead = seconds * self.motion(self._still, velocity)
        approach = min(2 * ahead, self._foreseen) if ahead < math.inf else self._foreseen
        more = max(approach - self._spare, 0.0)
        self._more = _MORE * more
        if 2 * self._moved + more <= self._margin and self._changed <= self._change:
            return False
        self._renew(position, position, more, 0.5 * approach, self._changed)
        return True

    def follow(self, before: Array, now: Array, farthest: float) -> bool | None:
        """
        Make the list complete for a linear path; return whether it is a new one.

        Parameters
        ----------
        before, now
            Flat arrays of positions, m; the list was complete at the first.
        farthest
            Longest path, m.

        Returns
        -------
        bool or None
            None if the path is longer, or not finite: the list is as it was.

        """
        self._moved, self._changed = self._measure(self._listed, now)
        if 2 * self._moved <= self._margin and self._changed <= self._change:
            return False
        moved, changed = self._measure(before, now)
        if not moved <= farthest:
            return None
        self._renew(before, now, self._more, moved, max(changed, self._changed))
        return True

    def _renew(self, before: Array, now: Array, more: float, moved: float, changed: float) -> None:
        """
        Make a new list, which is complete on a path.

        Parameters
        ----------
        before, now
            Flat arrays of positions, m.
        more
            By how much more than the least the list must reach, m.
        moved, changed
            How far particles move and edges change in a part, m.

        """
        self.renewals += 1
        self._listed[...] = now
        self._moved = self._changed = 0.0
        swept = before is not now and (
            2 * moved > self._margin_for(moved, _PARTS, 0) or changed > self._changes[1]
        )
        self._blocks.bound(now, *self._layout[:2])
        if swept:
            self._blocks.bound(before, *self._layout[:2], extend=True)
        self._blocks.finish()
        count = self._find_cells(self._parts, more, moved, changed)
        if count <= _SHORT * len(self._bounded):
            self._parts = min(2 * self._parts, _PARTS_IF_SHORT)
        elif self._parts > _PARTS:
            self._parts = _PARTS
            count = self._find_cells(self._parts, more, moved, changed)
        counts = [0, 0]
        if count:
            reach = self._reach + self._margin
            after = self._points[1]
            load_vectors(now, *self._layout[:2], self._size[1], self._all, after)
            start = after
            if swept:
                start = self._points[0]
                load_vectors(before, *self._layout[:2], self._size[1], self._all, start)
            cells = self._cells[:count]
            bound_features(start, after, *self._size, cells, self._bounded, self._boxes)
            for edges in (False, True):
                counts[edges] = self._find(cells, reach, 2 * moved if swept else 0.0, edges)
        self._take(counts)

    def _margin_for(self, moved: float, parts: int, limit: int) -> float:
        return min(max(self._least_margin, parts * moved), self._margins[limit])

    def _find_cells(self, parts: int, more: float, moved: float, changed: float) -> int:
        """Choose the margins for so many parts; return the number of pairs of cells."""
        self._margin = more + self._margin_for(moved, 2 * parts, int(parts > _PARTS))
        least, most = self._changes
        self._change = min(max(least, _MORE_CHANGE * changed), most)
        while True:
            count = self._blocks.near_cells(
                self._reach, self._far, self._flat, self._margin, self._change, self._cells
            )
            if count <= len(self._cells):
                return count
            self._cells = np.empty((int(_GROWTH * count), 2), np.int64)

    def _find(self, cells: Array, reach: float, path: float, edges: bool) -> int:
        while True:
            count: int = find_pairs(
                self._points[1], *self._size, self._boxes, cells, reach, path, edges,
                *self._arrays[edges],
            )  # fmt: skip
            if count <= len(self._arrays[edges][0]):
                return count
            self._arrays[edges] = self._room(int(_GROWTH * count))

    def warm_up(self, position: Array) -> None:
        """Compile the kernels; the list is empty afterwards."""
        self._renew(position, position, 0.0, 0.0, 0.0)
        after, cells = self._points[1], self._cells[:0]
        load_vectors(position, *self._layout[:2], self._size[1], self._all, after)
        bound_features(after, after, *self._size, cells, self._bounded, self._boxes)
        for edges in (False, True):
            self._find(cells, 0.0, 0.0, edges)
        self.invalidate()
