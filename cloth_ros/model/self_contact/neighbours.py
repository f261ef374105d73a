"""Keep a list of the pairs of features that are near each other; renew it when it may miss one."""

from __future__ import annotations

import math

import numpy as np

from ..grid import Array, Grid
from .block_tree import Blocks
from .contact_search import REACH
from .flatness import NEAREST
from .motion import measure
from .pair_list import bound_features, find_pairs
from .particle_arrays import load_vectors

# Distance of features, in thicknesses, in parts of the sheet that count as flat.
_FLAT = 1.02 * REACH
# Shares of what edges can lose before a flat sheet counts as one that is not flat: by which edges
# may change, at least and at most, until the list is renewed; and how many times as much as they
# have.  The vibrations of springs do not grow.
_LEAST_CHANGE, _MOST_CHANGE, _MORE_CHANGE = 0.04, 0.3, 1.5
# The same in a sheet that lies in layers, at most as a share of the spacing; and the rows and
# columns to which what changes edges may spread.
_MOST_IF_LAYERED, _MORE_IF_LAYERED, _AROUND = 1.0, 4.0, 2
# Share by which particles may move faster in the next part; and of the speed in the last part that
# a particle may have again in the next one.
_MORE, _LATELY = 1.2, 0.9
# Margin of a list for the motion of the particles of a cell, in thicknesses: at least; at most,
# without and with layers.  And in spacings, at most: of the fastest cells where there are layers,
# and of all cells of a short list.
_LEAST_MARGIN, _MOST_MARGIN, _MOST_IN_LAYERS = 0.15, 0.35, 0.6
_MOST_IF_FAST, _MOST_IF_SHORT = 1.0, 2.0
_FASTEST = 0.05  # share of the cells
# Parts for which a list is made, at least, at most if it is short, and in a sheet that lies in
# layers; and what is short, and what are layers, in pairs of cells by the number of particles.
_PARTS, _PARTS_IF_SHORT, _PARTS_IF_LAYERED = 4, 64, 16
_SHORT, _LAYERED = 0.02, 1.0
# Renewals after which a sheet may be one that does not lie in layers any more.
_RETRIED = 64
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
        Particles, a unit vector, and the distance of each pair where the list was made, m: see
        `contact_search`.
    groups, nearest
        Pairs of two cells each: the first pair and both cells, int64, shape (k + 1, 3), with one
        more at the end, and the least of their distances, m, shape (k,).
    vertices
        Number of groups, at the beginning, with pairs of a vertex and a triangle.
    ahead
        How far the particles of each cell may move in the next part, m.
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
        self._least_change = _LEAST_CHANGE * room
        self._most_changes = (_MOST_CHANGE * room, _MOST_IF_LAYERED * spacing)
        self._least_margin, self._most_margin = _LEAST_MARGIN * thickness, _MOST_MARGIN * thickness
        self._most_in_layers = _MOST_IN_LAYERS * thickness
        self._most_if_fast, self._most_if_short = _MOST_IF_FAST * spacing, _MOST_IF_SHORT * spacing
        number = rows * columns
        self._blocks = Blocks(rows, columns, dtype)
        self._cells: Array = np.empty((_LEAST_ROOM, 2), np.int64)
        self._boxes = np.empty((6, number, 6))
        self._bounded = np.zeros(number, np.bool_)
        self._all = np.arange(number)
        # Positions at which the list was made; of each cell, how far its particles have moved and
        # how much its sides have changed since then, and may, and do in a part, m, shape (2, n).
        self._listed = grid.field(dtype)
        self._moved: Array = np.zeros((2, number), dtype)
        self._margins, self._paths = self._moved.copy(), self._moved.copy()
        # How far the particles of each cell may move in a part, and how much its sides change,
        # of late, m.
        self._lately: Array = np.zeros((2, number), dtype)
        self._still = grid.field(dtype)
        self._scratch: Array = np.zeros((3, number), dtype)
        self.mean: Array = np.zeros(3)
        self.ahead: Array = np.zeros(number, dtype)
        self._points = np.zeros((2, number, 3))
        self._parts, self._layered, self.renewals = _PARTS, False, 0
        self._arrays = [_room(_LEAST_ROOM), _room(_LEAST_ROOM)]
        none: Array = np.zeros(0, np.int64)
        self._firsts: list[Array] = [none, none]
        self._empty: tuple[Array, ...] = (*_room(0), np.zeros((1, 3), np.int64), np.zeros(0), none)
        self.invalidate()

    def invalidate(self) -> None:
        """Renew the list when it is next needed."""
        self._margins[:] = -1.0
        self._take(self._cells[:0], [0, 0])

    def _take(self, cells: Array, counts: list[int]) -> None:
        """Make a list of so many pairs of both kinds, which were found in these pairs of cells."""
        if sum(counts) == 0:
            self.vertices = 0
            self.pairs, self.normals, self.distances = self._empty[:3]
            self.groups, self.nearest, self.used = self._empty[3:]
            return
        self.pairs, self.normals, self.distances = (
            np.concatenate([array[:count] for array, count in zip(both, counts, strict=True)])
            for both in zip(*self._arrays, strict=True)
        )
        groups, before = [], 0
        for first, count in zip(self._firsts, counts, strict=True):
            firsts = first[: len(cells)]
            some = np.diff(firsts, append=count) > 0
            groups.append(np.column_stack([before + firsts[some], cells[some]]))
            before += count
        self.vertices = len(groups[0])
        self.groups = np.concatenate([*groups, [[before, 0, 0]]])
        self.nearest = np.minimum.reduceat(self.distances, self.groups[:-1, 0])
        used = np.zeros(len(self._bounded), np.bool_)
        used[self.pairs] = True
        self.used = np.flatnonzero(used)

    def motion(self, before: Array, now: Array, cells: Array) -> float:
        """
        Return how far particles have moved, m, beyond the mean; NaN if that is not finite.

        `cells` receives how far those of each cell have, m, shape (rows * columns,).
        """
        return measure(before, now, self._layout, self._scratch, self.mean, cells)

    def _measure(self, before: Array, now: Array, cells: Array) -> float:
        """Return the same; `cells` receives the change of edges, too, m, shape (2, n)."""
        return measure(before, now, self._layout, self._scratch, self.mean, cells[0], cells[1])

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
        finite = self.motion(self._still, velocity, self.ahead) < math.inf
        self.ahead *= seconds
        if not finite:
            self.ahead[:] = self._foreseen
        np.maximum(self.ahead, _LATELY * self._lately[0], out=self._lately[0])
        if (self._moved[0] + self._more(self.ahead) <= self._margins[0]).all() and self._is_flat():
            return False
        self._paths[0] = np.minimum(self.ahead, 0.5 * self._foreseen)
        self._paths[1] = self._moved[1]
        self._renew(position, position)
        return True

    def _more(self, ahead: Array) -> Array:
        """Return by how much more than the least a list has to reach, m, shape (n,)."""
        more: Array = np.minimum(ahead, self._foreseen) - 0.5 * self._spare
        return np.maximum(more, 0.0)

    def _is_flat(self) -> bool:
        """Return whether edges have changed no more than was allowed for."""
        return bool((self._moved[1] <= self._margins[1]).all())

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
        self._measure(self._listed, now, self._moved)
        if (self._moved <= self._margins).all():
            return False
        changes = self._moved[1].copy()
        if not self._measure(before, now, self._paths) <= farthest:
            return None
        np.maximum(self._paths[1], changes, out=self._paths[1])
        self._renew(before, now)
        return True

    def _renew(self, before: Array, now: Array) -> None:
        """
        Make a new list, which is complete on a path.

        Parameters
        ----------
        before, now
            Flat arrays of positions, m.

        """
        self.renewals += 1
        self._listed[...] = now
        np.maximum(self._paths[1], _LATELY * self._lately[1], out=self._lately[1])
        if self.renewals % _RETRIED == 0 and self._layered:
            self._parts, self._layered = _PARTS, False
        self._choose_margins()
        swept = before is not now and bool((self._paths > self._margins).any())
        self._blocks.bound(now, *self._layout[:2])
        if swept:
            self._blocks.bound(before, *self._layout[:2], extend=True)
        self._blocks.finish()
        count = self._find_cells()
        number = len(self._bounded)
        if count <= _SHORT * number:
            self._parts, self._layered = min(2 * self._parts, _PARTS_IF_SHORT), False
        elif self._parts > _PARTS and not self._layered:
            self._parts = _PARTS
            self._choose_margins()
            count = self._find_cells()
        if count > _LAYERED * number and not self._layered:
            self._parts, self._layered = _PARTS_IF_LAYERED, True
            self._choose_margins()
            count = self._find_cells()
        cells, counts = self._cells[:count], [0, 0]
        if count:
            after = self._points[1]
            load_vectors(now, *self._layout[:2], self._size[1], self._all, after)
            start = after
            if swept:
                start = self._points[0]
                load_vectors(before, *self._layout[:2], self._size[1], self._all, start)
            else:
                self._paths[:] = 0.0
            bound_features(start, after, *self._size, cells, self._bounded, self._boxes)
            for edges in (False, True):
                counts[edges] = self._find(cells, edges=edges)
        self._moved[:] = 0.0
        self._take(cells, counts)

    def _choose_margins(self) -> None:
        """Choose what the list stays complete for, by what happens in a part."""
        moved, changed = self._paths
        if self._layered:
            margins = np.clip(self._parts * moved, self._least_margin, self._most_in_layers)
            fast = moved > np.quantile(moved, 1 - _FASTEST)
            margins[fast] = np.clip(
                self._parts * moved[fast], self._most_in_layers, self._most_if_fast
            )
            around = _greatest_around(self._lately[1].reshape(self._size), _AROUND)
            more = _MORE_IF_LAYERED * around.ravel()
        else:
            most = self._most_if_short if self._parts > _PARTS else self._most_margin
            margins = np.clip(self._parts * moved, self._least_margin, most)
            more = np.full_like(moved, _MORE_CHANGE * changed.max())
        self._margins[0] = _MORE * self._more(self._lately[0]) + margins
        self._margins[1] = np.clip(more, self._least_change, self._most_changes[self._layered])

    def _find_cells(self) -> int:
        """Return the number of pairs of cells."""
        while True:
            count = self._blocks.near_cells(
                self._reach, self._far, self._flat, self._margins[0], self._margins[1], self._cells
            )
            if count <= len(self._cells):
                return count
            self._cells = np.empty((int(_GROWTH * count), 2), np.int64)

    def _find(self, cells: Array, *, edges: bool) -> int:
        if len(self._firsts[edges]) < len(cells):
            self._firsts[edges] = np.zeros(len(self._cells), np.int64)
        while True:
            count: int = find_pairs(
                self._points[1], *self._size, self._boxes, cells, self._reach, self._margins[0],
                self._paths[0], edges, *self._arrays[edges], self._firsts[edges],
            )  # fmt: skip
            if count <= len(self._arrays[edges][0]):
                return count
            self._arrays[edges] = _room(int(_GROWTH * count))

    def warm_up(self, position: Array) -> None:
        """Compile the kernels; the list is empty afterwards."""
        self._renew(position, position)
        after, cells = self._points[1], self._cells[:0]
        load_vectors(position, *self._layout[:2], self._size[1], self._all, after)
        bound_features(after, after, *self._size, cells, self._bounded, self._boxes)
        for edges in (False, True):
            self._find(cells, edges=edges)
        self.invalidate()


def _greatest_around(values: Array, distance: int) -> Array:
    """Return the greatest value up to so many rows and columns from each cell."""
    for axis in (0, 1):
        for _ in range(distance):
            first, second = np.moveaxis(values, axis, 0), np.moveaxis(values.copy(), axis, 0)
            np.maximum(second[1:], first[:-1], out=second[1:])
            np.maximum(second[:-1], first[1:], out=second[:-1])
            values = np.moveaxis(second, 0, axis)
    return values


def _room(count: int) -> tuple[Array, Array, Array]:
    return np.empty((count, 4), np.uint32), np.empty((count, 3), np.float32), np.empty(count)
