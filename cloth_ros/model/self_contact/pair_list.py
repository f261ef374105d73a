"""
Pairs of features of the sheet that are near each other, in groups that can be replaced.

Groups are in the order of their cells along a curve, and pairs in that of their features, whatever
the positions are: results that depend on the order do not depend on when a group was found.  The
curve is that of Morton, 1966; contacts that are treated row by row come to rest more slowly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..grid import Array
from ..kernels.jit import exact, exact_inlined

_LEAST_ROOM = 1024
# Share of the length of the arrays of pairs that is added when they are too short.
_GROWTH = 1.5
# Rows from which on those of pairs that were replaced are freed, by the number of all others.
_MOST_ROOM = 3

_NO_GROUPS: Array = np.empty((0, 4), np.int64)
_NO_DISTANCES: Array = np.empty(0)

# Parts of a list that threads work at one by one.
CHUNKS = 16
# Rows for the pairs of each pair of cells, at first, and for each chunk in addition.
_EXPECTED, _SPARE = 5, 64

# Searches for pairs of vertices and triangles (False) or of edges (True): the last arguments of
# `pair_search.find_pairs`.
Search = Callable[..., None]


@exact_inlined
def chunk_range(count, chunk):  # type: ignore[no-untyped-def]
    """Return the first of the elements of a chunk, and the one after its last one."""
    return count * chunk // CHUNKS, count * (chunk + 1) // CHUNKS


@exact
def _gather(groups, pairs, normals, distances, out_pairs, out_normals, out_distances):  # type: ignore[no-untyped-def]
    """Copy the pairs of all groups to other arrays, one group after the other."""
    count = 0
    for g in range(len(groups)):
        first = count
        for p in range(groups[g, 0], groups[g, 1]):
            for n in range(4):
                out_pairs[count, n] = pairs[p, n]
            for n in range(3):
                out_normals[count, n] = normals[p, n]
            out_distances[count] = distances[p]
            count += 1
        groups[g, 0], groups[g, 1] = first, count
    return count


@exact_inlined
def _key(first, second):  # type: ignore[no-untyped-def]
    """Return the place of a group in the order, by the ranks of both cells."""
    return (first << 31) + second


@exact_inlined
def _copy_group(groups, nearest, g, out, out_nearest, count):  # type: ignore[no-untyped-def]
    # Number by number: to copy a row takes ten times as long.
    h = np.uint64(count)
    out[h, 0], out[h, 1] = groups[g, 0], groups[g, 1]
    out[h, 2], out[h, 3] = groups[g, 2], groups[g, 3]
    out_nearest[h] = nearest[g]


@exact
def _merge(  # type: ignore[no-untyped-def]
    groups, nearest, begin, end, cells, new, new_nearest, keys, ranks, out, out_nearest, count,
    added,
):  # fmt: skip
    """Copy groups, without those of some cells, and new ones in the order of their cells."""
    h, number, most = 0, len(new), np.iinfo(np.int64).max
    key = keys[0] if number else most
    for group in range(begin, end):
        g = np.uint64(group)
        a, b = np.uint64(groups[g, 2]), np.uint64(groups[g, 3])
        if cells[a] or cells[b]:
            continue
        while key < _key(ranks[a], ranks[b]):
            _copy_group(new, new_nearest, np.uint64(h), out, out_nearest, count)
            added[h] = count
            h += 1
            count += 1
            key = keys[h] if h < number else most
        _copy_group(groups, nearest, g, out, out_nearest, count)
        count += 1
    while h < number:
        _copy_group(new, new_nearest, np.uint64(h), out, out_nearest, count)
        added[h] = count
        h += 1
        count += 1
    return count


@exact
def _mark(groups, cells):  # type: ignore[no-untyped-def]
    """Mark the cells of groups."""
    cells[:] = False
    for g in range(len(groups)):
        cells[groups[g, 2]] = cells[groups[g, 3]] = True


@exact
def _add_offsets(groups, nearest, added, offsets, distances):  # type: ignore[no-untyped-def]
    for g in added:
        offset = offsets[groups[g, 2]] + offsets[groups[g, 3]]
        nearest[g] += offset
        for p in range(groups[g, 0], groups[g, 1]):
            distances[p] += offset


class PairList:
    """
    Pairs of features, in groups of those of two cells.

    Parameters
    ----------
    rows, columns
        Of the sheet.  Each particle begins a cell.

    Attributes
    ----------
    pairs, normals, distances
        Particles, shape (n, 4), a unit vector, shape (n, 3), and a distance, m, shape (n,).
    groups, nearest
        First pair, the row after the last one, and both cells of each group, int64, shape (k, 4);
        and the least of its distances, m, shape (k,).
    vertices
        Number of groups, at the beginning, with pairs of a vertex and a triangle.
    added
        Groups that were found last.
    cells
        True for the cells of groups: bool, shape (rows * columns,).
    used
        Particles at the corners of these cells, ascending.

    """

    def __init__(self, rows: int, columns: int) -> None:
        self._size = (rows, columns)
        self._ranks = _ranks(rows, columns)
        # Arrays of groups, of which one is written while the other is read.
        self._present, self._spare = ((_NO_GROUPS, _NO_DISTANCES) for _ in range(2))
        self.clear()

    def clear(self) -> None:
        """Remove all pairs."""
        self.pairs, self.normals, self.distances = _room(_LEAST_ROOM)
        self._end = self.vertices = 0
        self.groups, self.nearest = _NO_GROUPS, _NO_DISTANCES
        self.added: Array = np.zeros(0, np.int64)
        self.used: Array = self.added
        self.cells: Array = np.zeros(self._size[0] * self._size[1], np.bool_)

    @property
    def empty(self) -> bool:
        """Whether there are no pairs."""
        return len(self.groups) == 0

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array, Array, int]:
        """Pairs, normals, distances, groups, nearest, vertices."""
        return (
            self.pairs, self.normals, self.distances, self.groups, self.nearest, self.vertices,
        )  # fmt: skip

    def replace(self, cells: Array, most: int, search: Search) -> None:
        """
        Replace the groups with one of some cells.

        Parameters
        ----------
        cells
            True for these cells: bool, shape (rows * columns,).
        most
            Largest number of new groups of each kind.
        search
            Finds the new ones.

        """
        if cells.all():
            self.groups, self.nearest, self.vertices, self._end = _NO_GROUPS, _NO_DISTANCES, 0, 0
        pairs = int((self.groups[:, 1] - self.groups[:, 0]).sum())
        if self._end > _MOST_ROOM * (pairs + _LEAST_ROOM):
            self._gather()
        found = [self._search(edges, most, search) for edges in (False, True)]
        size = len(self.groups) + sum(len(new) for new, _ in found)
        if size > len(self._spare[1]):
            self._spare = (np.empty((2 * size, 4), np.int64), np.empty(2 * size))
        self._present, self._spare = self._spare, self._present
        out, least = self._present
        added, count, vertices = [], 0, 0
        bounds = ((0, self.vertices), (self.vertices, len(self.groups)))
        for (begin, end), (new, distances) in zip(bounds, found, strict=True):
            keys = (self._ranks[new[:, 2]] << 31) + self._ranks[new[:, 3]]
            order = np.argsort(keys)
            added.append(np.empty(len(new), np.int64))
            vertices = count
            count = _merge(
                self.groups, self.nearest, begin, end, cells, new[order], distances[order],
                keys[order], self._ranks, out, least, count, added[-1],
            )  # fmt: skip
        self.groups, self.nearest, self.vertices = out[:count], least[:count], vertices
        self.added = np.concatenate(added)
        _mark(self.groups, self.cells)
        self.used = self._corners()

    def _search(self, edges: bool, most: int, search: Search) -> tuple[Array, Array]:
        """Return the groups and least distances of new pairs, which are appended."""
        if most == 0:
            return _NO_GROUPS, _NO_DISTANCES
        groups, nearest = np.empty((most, 4), np.int64), np.empty(most)
        counts: Array = np.empty((2, CHUNKS), np.int64)
        room = _EXPECTED * most // CHUNKS + _SPARE
        while True:
            end = self._end + CHUNKS * room
            if end > len(self.pairs):
                self._make_room(end)
            search(edges, self._end, room, *self.arrays[:3], groups, nearest, counts)
            if counts[0].max() <= room:
                break
            room = int(_GROWTH * counts[0].max())
        self._end = end
        parts = [
            slice(first, first + count)
            for first, count in zip(most * np.arange(CHUNKS) // CHUNKS, counts[1], strict=True)
        ]
        return (
            np.concatenate([groups[part] for part in parts]),
            np.concatenate([nearest[part] for part in parts]),
        )

    def _corners(self) -> Array:
        """Return the particles at the corners of cells with a pair."""
        used = self.cells.reshape(self._size).copy()
        used[1:] |= used[:-1].copy()
        used[:, 1:] |= used[:, :-1].copy()
        return np.flatnonzero(used)

    def _make_room(self, count: int) -> None:
        """Make room for so many pairs."""
        before, end = self.arrays[:3], self._end
        self.pairs, self.normals, self.distances = _room(int(_GROWTH * count))
        for old, new in zip(before, self.arrays[:3], strict=True):
            new[:end] = old[:end]

    def _gather(self) -> None:
        """Free the rows of pairs whose group was replaced."""
        before = self.arrays[:3]
        self.pairs, self.normals, self.distances = _room(len(self.pairs))
        self._end = _gather(self.groups, *before, *self.arrays[:3])

    def offset(self, offsets: Array) -> None:
        """Add numbers of both cells, m, shape (rows * columns,), to the distances last found."""
        _add_offsets(self.groups, self.nearest, self.added, offsets, self.distances)

    def warm_up(self) -> None:
        """Compile the kernels."""
        self._gather()
        self.offset(np.zeros(self._size[0] * self._size[1]))


def _ranks(rows: int, columns: int) -> Array:
    """Return the place of each cell on a curve through all of them, shape (rows * columns,)."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    ranks = np.zeros_like(row)
    for bit in range(max(rows, columns).bit_length()):
        ranks |= ((row >> bit & 1) << 2 * bit + 1) | ((column >> bit & 1) << 2 * bit)
    return ranks


def _room(count: int) -> tuple[Array, Array, Array]:
    return np.empty((count, 4), np.uint32), np.empty((count, 3), np.float32), np.empty(count)
