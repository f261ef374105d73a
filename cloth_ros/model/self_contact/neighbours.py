"""Keep a list of the pairs of features that are near each other; renew it when it may miss one."""

from __future__ import annotations

import numpy as np

from ..grid import Array, Grid
from .contact_search import REACH
from .flatness import FRAME, TILE, bound_edges, find_flat, still_flat
from .motion import farthest
from .pair_list import bound_cells, bound_features, find_near_tiles, find_pairs
from .particle_arrays import load_vectors

# Least margin of a list, in thicknesses.
_LEAST_MARGIN = 0.5
# Margin, in displacements in a part: half of the parts that a list lasts.
_PARTS = 4.0
# Distance of features, in thicknesses, in parts of the sheet that count as flat.
_FLAT = 1.02 * REACH
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
    thickness, longest
        Of the sheet, and the longest margin, m.

    Attributes
    ----------
    pairs, normals, gaps
        Particles, a unit vector, and the gap along it, of each pair: see `contact_search.search`.
    vertices
        Number of pairs, at the beginning, of a vertex and a triangle.

    """

    def __init__(self, grid: Grid, dtype: type, thickness: float, longest: float) -> None:
        rows, columns = self._size = (grid.rows, grid.columns)
        self._layout = (grid.begin, grid.stride, rows, columns)
        self._tiles = (-(-rows // TILE), -(-columns // TILE))
        tiles = self._tiles[0] * self._tiles[1]
        self._reach, self._flat_distance = REACH * thickness, _FLAT * thickness
        self._margins = (_LEAST_MARGIN * thickness, longest)
        self._edges = np.empty((2, tiles, 6))
        self._frame = np.zeros((tiles, FRAME))
        self._flat = np.zeros(tiles, np.int64)
        self._cell_bounds = np.empty((rows * columns, 6))
        self._tile_bounds = np.empty((tiles, 6))
        self._feature_bounds = np.empty((6, rows * columns, 6))
        self._tile_pairs: Array = np.empty((_LEAST_ROOM, 2), np.int64)
        # Positions at which the list was made.
        self._listed = grid.field(dtype)
        # And when flat parts were last found to be so, with the slack that they had, m.
        self._examined, self._slack = grid.field(dtype), 0.0
        self._still = grid.field(dtype)
        self._scratch: Array = np.empty((3, columns), dtype)
        self.mean = np.zeros(3)
        self._points = np.zeros((2, rows * columns, 3))
        self._arrays = [self._room(_LEAST_ROOM), self._room(_LEAST_ROOM)]
        self.invalidate()

    @staticmethod
    def _room(count: int) -> tuple[Array, Array, Array]:
        return (
            np.empty((count, 4), np.uint32),
            np.empty((count, 3), np.float32),
            np.empty(count, np.float32),
        )

    def invalidate(self) -> None:
        """Renew the list at the next update."""
        self._margin = -1.0
        self.vertices = 0
        self.pairs, self.normals, self.gaps = self._room(0)

    def motion(self, before: Array, now: Array) -> float:
        """Return how far particles have moved, m, beyond the mean; NaN if that is not finite."""
        return farthest(before, now, self._layout, self._scratch[0], self.mean)

    def speed(self, velocity: Array) -> float:
        """Return the greatest speed of a particle, m/s, apart from the mean velocity."""
        return self.motion(self._still, velocity)

    def stays_empty(self, now: Array, ahead: float, reach: float) -> bool:
        """
        Return True only if the list is empty, and complete as it is, by a quick test.

        Parameters
        ----------
        now
            Flat array of positions, m.
        ahead
            How far particles may move in the next part, m, apart from the mean.
        reach
            As in `update`.

        """
        if len(self.pairs) or self._margin < 0.0:
            return False
        if not 2 * self.motion(self._listed, now) + reach - self._reach <= self._margin:
            return False
        return 2 * (self.motion(self._examined, now) + ahead) < self._slack

    def update(self, before: Array, now: Array, ahead: Array, reach: float) -> bool:
        """
        Make the list complete for a linear path; return whether it is a new one.

        Parameters
        ----------
        before, now
            Flat arrays of positions, m, which are finite; the list was complete at the first.
        ahead
            Those expected after the next part.
        reach
            m, within which the pairs at its end are needed.

        """
        more = reach - self._reach
        if self._margin >= 0.0 and 2 * self.motion(self._listed, now) + more <= self._margin:
            self._bound_edges(now, clear=True)
            self._bound_edges(ahead, clear=False)
            slack = still_flat(
                self._edges, *self._tiles, self._flat_distance, self._frame, self._flat
            )
            if slack > 0.0:
                self._examined[...], self._slack = now, slack
                return False
        self._renew(before, now, ahead, more)
        return True

    def _bound_edges(self, position: Array, *, clear: bool) -> None:
        bound_edges(position, *self._layout, self._scratch[1:], self._edges, clear)

    def _renew(self, before: Array, now: Array, ahead: Array, more: float) -> None:
        motion = self.motion(before, now)
        margin = more + min(max(self._margins[0], _PARTS * motion), self._margins[1])
        swept = 2 * motion > margin
        self._listed[...] = now
        self._bound_edges(now, clear=True)
        self._bound_edges(before, clear=False)
        self._bound_edges(ahead, clear=False)
        self._examined[...] = now
        self._slack = find_flat(
            self._edges, *self._tiles, self._flat_distance, self._frame, self._flat
        )
        for field, points in zip((before, now), self._points, strict=True):
            load_vectors(field, *self._layout[:2], self._size[1], points)
        path = (self._points[0] if swept else self._points[1], self._points[1])
        bound_cells(*path, *self._size, self._cell_bounds, self._tile_bounds)
        reach = self._reach + margin
        while True:
            count, clear = find_near_tiles(
                self._tile_bounds, self._tiles[1], self._flat, reach, self._tile_pairs
            )
            if count <= len(self._tile_pairs):
                break
            self._tile_pairs = np.empty((int(_GROWTH * count), 2), np.int64)
        self._margin = margin
        counts = [0, 0]
        if count == 0:
            self._margin = max(clear - self._reach, margin)
        else:
            bound_features(*path, *self._size, self._feature_bounds)
            for edges in (False, True):
                counts[edges] = self._find(self._tile_pairs[:count], reach, swept, motion, edges)
        parts = [
            tuple(array[:number] for array in arrays)
            for arrays, number in zip(self._arrays, counts, strict=True)
        ]
        self.pairs, self.normals, self.gaps = (
            np.concatenate(both) for both in zip(*parts, strict=True)
        )
        self.vertices = counts[0]

    def _find(
        self, tile_pairs: Array, reach: float, swept: bool, motion: float, edges: bool
    ) -> int:
        while True:
            count: int = find_pairs(
                self._points[1], *self._size, self._cell_bounds, self._tile_bounds,
                self._feature_bounds, tile_pairs, reach, swept, 2 * motion, edges,
                *self._arrays[edges],
            )  # fmt: skip
            if count <= len(self._arrays[edges][0]):
                return count
            self._arrays[edges] = self._room(int(_GROWTH * count))

    def warm_up(self, position: Array) -> None:
        """Compile the kernels; the list is empty afterwards."""
        self.motion(position, position)
        self._renew(position, position, position, 0.0)
        bound_features(*self._points, *self._size, self._feature_bounds)
        self._find(self._tile_pairs[:0], 0.0, False, 0.0, False)
        still_flat(self._edges, *self._tiles, self._flat_distance, self._frame, self._flat)
        self.invalidate()
