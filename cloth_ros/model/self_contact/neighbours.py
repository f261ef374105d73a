"""
Keep a list of the pairs of features that are near each other; renew it where it may miss one.

The list is complete while the particles of each cell move no farther than a margin, and its sides
change no more than another one.  Where cells have moved farther, their pairs and those of cells
around them are found anew, and their motion counts from there on.  Where sides have changed more,
all pairs are.
"""

from __future__ import annotations

import math

import numpy as np

from ..grid import Array, Grid
from ..kernels.thread_pool import ThreadPool
from .block_tree import Blocks
from .contact_search import REACH
from .flatness import NEAREST
from .motion import measure, refer, write_edges
from .pair_list import PairList
from .pair_search import bound_features, find_pairs
from .particle_arrays import load_vectors

# Distance of features, in thicknesses, in parts of the sheet that count as flat.
_FLAT = 1.02 * REACH
# How far the particles of a cell with pairs may move at least and at most, in thicknesses; the
# same in a sheet that lies in layers; and those of a cell without pairs at most, in spacings.
_MARGINS, _MARGINS_IN_LAYERS, _MOST_MARGIN = (0.15, 0.35), (0.12, 0.3), 2.0
# What edges of a cell may change at least and at most, as a share of what they can lose before a
# flat sheet counts as one that is not flat; and in a sheet that lies in layers, where cells that
# exceed it do not count as parts of flat blocks any more.
_CHANGES, _CHANGE_IN_LAYERS = (0.04, 0.3), 0.6
# Pairs of cells in reach by the number of cells, from which on a sheet counts as one in layers.
_LAYERED = 0.3
# Parts for which the first margins are made, and the factor of one that was exceeded.
_PARTS, _WIDER = 4, 2.0
# Share by which particles may move faster in the next part; and of the speed in the last part that
# a particle may have again in the next one.
_MORE, _LATELY = 1.2, 0.9
# Motion, in thicknesses, up to which the part after the next one is allowed for as well; lists for
# two parts of fast motion would be too long.
_FURTHER = 0.25
# Share of the cells from which on all pairs are found anew; growth of the list from which on they
# are; and groups by the number of cells up to which they are, which takes no longer.
_WHOLE, _LONGER, _FEW = 0.5, 1.5, 1.0
# Share of a margin from which on pairs are found anew as well: each time has a cost of its own.
_SOON = 0.8
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
    threads
        That find pairs.

    Attributes
    ----------
    list
        The pairs, with their distances where they were found.
    whole
        True if all pairs were found anew by the last renewal.
    ahead
        How far the particles of each cell may move in the next part, m.
    renewals
        Number of times that the list was renewed, as a whole or in some cells.

    """

    def __init__(
        self, grid: Grid, dtype: type, thickness: float, spacing: float, foreseen: float,
        threads: ThreadPool,
    ) -> None:  # fmt: skip
        self._threads = threads
        rows, columns = self._size = (grid.rows, grid.columns)
        self._layout = (grid.begin, grid.stride, rows, columns)
        self._flat_indices = grid.flat_indices
        self._reach, self._far = REACH * thickness, thickness + foreseen
        # Features that are two cells apart must be farther apart than those that are foreseen.
        self._flat = max(_FLAT * thickness, 0.5 * NEAREST * self._far)
        self._spare, self._foreseen = self._reach - thickness, foreseen
        room = spacing - self._flat / NEAREST
        # Without layers, and with them.
        self._limits = np.multiply((_MARGINS, _MARGINS_IN_LAYERS), thickness)
        self._changes = np.multiply((*_CHANGES, _CHANGE_IN_LAYERS), room)
        self._most_margin, self._further = _MOST_MARGIN * spacing, _FURTHER * thickness
        number = rows * columns
        self._blocks = Blocks(rows, columns, dtype)
        self._cells: Array = np.empty((_LEAST_ROOM, 2), np.int64)
        self._boxes = np.empty((6, number, 6))
        self._bounded = np.zeros(number, np.bool_)
        self._all = np.arange(number)
        # Positions and edges since which motion and change are measured; of each cell, how far
        # its particles have moved and how much its sides have changed since then, how much they
        # may, and may from where pairs were found, m, shape (2, n).
        self._reference, self._mean = grid.field(dtype), np.zeros(3)
        self._edges = (grid.field(dtype), grid.field(dtype))
        self._moved: Array = np.zeros((2, number), dtype)
        self._margins, self._chosen = self._moved.copy(), self._moved.copy()
        # How far the particles of each cell move on a path, and may in a part, of late, m.
        self._paths: Array = np.zeros(number, dtype)
        self._lately = self._paths.copy()
        self._still = grid.field(dtype)
        self._scratch: Array = np.zeros((3, number), dtype)
        self.mean: Array = np.zeros(3)
        self.ahead: Array = np.zeros(number, dtype)
        self._points = np.zeros((2, number, 3))
        self._layered, self._number, self.renewals = False, 0, 0
        self.list = PairList(rows, columns)
        self.invalidate()

    def invalidate(self) -> None:
        """Find all pairs anew when they are next needed."""
        self._margins[:], self.whole = -1.0, True
        self.list.clear()

    def motion(self, before: Array, now: Array, cells: Array) -> float:
        """
        Return how far particles have moved, m, beyond the mean; NaN if that is not finite.

        `cells` receives how far those of each cell have, m, shape (rows * columns,).
        """
        return measure(before, now, self._layout, self._scratch, self.mean, cells)

    def _measure(self, now: Array) -> None:
        """Measure how far particles have moved, and how much edges have changed."""
        measure(
            self._reference, now, self._layout, self._scratch, self._mean, self._moved[0],
            self._edges, self._moved[1],
        )  # fmt: skip

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
            Whether pairs were found anew.

        """
        finite = self.motion(self._still, velocity, self.ahead) < math.inf
        self.ahead *= seconds
        if not finite:
            self.ahead[:] = self._foreseen
        np.maximum(self.ahead, _LATELY * self._lately, out=self._lately)
        short = self._moved > self._margins
        short[0] = self._moved[0] + self._more(self.ahead) > self._margins[0]
        if not short.any():
            return False
        self._paths[:] = np.minimum(self.ahead, 0.5 * self._foreseen)
        self._renew(position, position, short)
        return True

    def _more(self, ahead: Array) -> Array:
        """Return by how much more than the least a list has to reach, m, shape (n,)."""
        more: Array = np.minimum(ahead, self._foreseen) - 0.5 * self._spare
        return np.maximum(more, 0.0)

    def follow(self, before: Array, now: Array, farthest: float) -> bool | None:
        """
        Make the list complete for a linear path; return whether pairs were found anew.

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
        self._measure(now)
        # So that what is not a number is short.
        short = ~(self._moved <= self._margins)
        if not short.any():
            return False
        if not self.motion(before, now, self._paths) <= farthest:
            return None
        self._renew(before, now, short)
        return True

    def _renew(self, before: Array, now: Array, short: Array) -> None:
        """
        Find the pairs of some cells, and of those beside them, anew: complete on a path.

        Parameters
        ----------
        before, now
            Flat arrays of positions, m.
        short
            True for cells that have moved, or whose sides have changed, too much: shape (2, n).

        """
        self.renewals += 1
        groups, few = len(self.list.groups), _FEW * len(self._all)
        # Cells may have been left out because of the sides of those between them.
        long = groups > _LONGER * max(self._number, few)
        self.whole = bool(long or groups <= few or short[1].any())
        if not self.whole:
            # With what the next part will need.
            needed = self._moved[0] + self._more(self._lately)
            renewed = (needed > _SOON * self._margins[0]) | short[0]
            renewed = _and_around(renewed.reshape(self._size)).ravel()
            self.whole = bool(np.count_nonzero(renewed) > _WHOLE * len(renewed))
        if self.whole:
            renewed = np.ones(len(self._all), np.bool_)
            self._mean[:] = 0.0
            write_edges(now, self._layout, self._edges)
        self._choose_margins(short)
        refer(now, self._mean, renewed, *self._layout, self._reference)
        self._measure(now)
        self._set_margins(renewed)
        swept = before is not now and bool((self._paths > self._margins[0]).any())
        self._blocks.bound(now, *self._layout[:2])
        if swept:
            self._blocks.bound(before, *self._layout[:2], extend=True)
        self._blocks.finish()
        count = self._find_cells(renewed)
        if self.whole and count == 0:
            self.list.clear()
        else:
            self._find(before, now, renewed, count, swept=swept)
        if self.whole:
            self._number = len(self.list.groups)
            near = np.count_nonzero(self.list.nearest < self._reach)
            self._layered = bool(near > _LAYERED * len(renewed))

    def _choose_margins(self, short: Array) -> None:
        """Choose what the list stays complete for, by what happened since pairs were found."""
        if (self._margins < 0.0).all():
            self._chosen[0], self._chosen[1] = _PARTS * self._paths, 0.0
        else:
            self._chosen[short] *= _WIDER
        margins, changes = self._chosen
        least, most = self._limits[int(self._layered)]
        most = np.where(self.list.cells, most, self._most_margin)
        np.clip(margins, least, most, out=margins)
        least, most, in_layers = self._changes
        if self._layered:
            changes[:] = np.where(changes > in_layers, math.inf, in_layers)
        else:
            np.clip(changes, least, most, out=changes)

    def _set_margins(self, renewed: Array) -> None:
        """Let the list stay complete for the chosen margins from where pairs were found."""
        more = _MORE * self._more(self._lately)
        margins = self._chosen[0] + self._moved[0] + more + np.minimum(more, self._further)
        np.copyto(self._margins[0], margins, where=renewed)
        if self.whole:
            self._margins[1] = self._chosen[1]

    def _find_cells(self, cells: Array) -> int:
        """Return the number of pairs of cells with one of these."""
        allowed = self._margins + self._moved
        while True:
            count = self._blocks.near_cells(
                self._reach, self._far, self._flat, allowed[0], allowed[1], self._cells, cells
            )
            if count <= len(self._cells):
                return count
            self._cells = np.empty((int(_GROWTH * count), 2), np.int64)

    def _find(self, before: Array, now: Array, renewed: Array, count: int, *, swept: bool) -> None:
        """Find the pairs of features in the pairs of cells."""
        cells, after = self._cells[:count], self._points[1]
        if not swept:
            self._paths[:] = 0.0
        if count:
            load_vectors(now, self._flat_indices, self._all, after)
            start = after
            if swept:
                start = self._points[0]
                load_vectors(before, self._flat_indices, self._all, start)
            bound_features(start, after, *self._size, cells, self._bounded, self._boxes)
        allowed = self._margins[0] + self._moved[0]

        def search(edges: bool, begin: int, room: int, *arrays: Array) -> None:
            self._threads.run(
                find_pairs, after, *self._size, self._boxes, cells, self._reach, allowed,
                self._paths, edges, begin, room, *arrays,
            )  # fmt: skip

        self.list.replace(renewed, count, search)

    def warm_up(self, position: Array) -> None:
        """Compile the kernels; the list is empty afterwards."""
        number = len(self._all)
        self._renew(position, position, np.ones((2, number), np.bool_))
        self.follow(position, position, math.inf)
        # Any two cells: there may be none that are near each other.
        self._cells[0] = 0, number - 1
        self._find(position, position, np.ones(number, np.bool_), 1, swept=False)
        self.list.offset(np.zeros(number))
        self.list.warm_up()
        self.invalidate()


def _and_around(marks: Array) -> Array:
    """Return marks of cells with those beside them, shape (rows, columns)."""
    for axis in (0, 1):
        first, second = np.moveaxis(marks, axis, 0), np.moveaxis(marks.copy(), axis, 0)
        second[1:] |= first[:-1]
        second[:-1] |= first[1:]
        marks = np.moveaxis(second, 0, axis)
    return marks
