"""Triangles of a sheet, and strain and speed of its cells."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Indices = NDArray[np.uint32]


def triangles(rows: int, columns: int) -> Indices:
    """
    Return the corners of the two triangles of each cell, shape (rows - 1, columns - 1, 2, 3).

    A cell is split from (row, column + 1) to (row + 1, column); the corners are counter-clockwise
    seen from the upper side of the sheet.
    """
    index = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    first, right = index[:-1, :-1], index[:-1, 1:]
    below, last = index[1:, :-1], index[1:, 1:]
    corners = [[first, right, below], [right, last, below]]
    return np.stack([np.stack(triangle, -1) for triangle in corners], -2)


def edge_lengths(positions: Floats) -> tuple[Floats, Floats]:
    """
    Return the lengths between neighbours, m.

    Parameters
    ----------
    positions
        Of the particles, m, shape (rows, columns, 3).

    Returns
    -------
    Along the rows, shape (rows, columns - 1), and along the columns, shape (rows - 1, columns).

    """
    along_rows = np.linalg.norm(np.diff(positions, axis=1), axis=-1)
    along_columns = np.linalg.norm(np.diff(positions, axis=0), axis=-1)
    return along_rows, along_columns


def cell_stretch(positions: Floats, spacing: tuple[float, float]) -> Floats:
    """
    Return the largest elongation of the edges of each cell, relative to the length at rest.

    Parameters
    ----------
    positions
        Of the particles, m, shape (rows, columns, 3).
    spacing
        Lengths at rest between neighbours along a row and along a column, m.

    Returns
    -------
    0 where no edge is longer, shape (rows - 1, columns - 1).

    """
    along_rows, along_columns = edge_lengths(positions)
    along_rows = along_rows / spacing[0] - 1
    along_columns = along_columns / spacing[1] - 1
    stretch = np.maximum(
        np.maximum(along_rows[:-1], along_rows[1:]),
        np.maximum(along_columns[:, :-1], along_columns[:, 1:]),
    )
    result: Floats = np.maximum(stretch, 0.0).astype(np.float32)
    return result


def cell_speed(velocities: Floats) -> Floats:
    """Return the mean speed of the corners of each cell, m/s, shape (rows - 1, columns - 1)."""
    speed = np.linalg.norm(velocities, axis=-1)
    corners = speed[:-1, :-1] + speed[:-1, 1:] + speed[1:, :-1] + speed[1:, 1:]
    mean: Floats = (corners / 4).astype(np.float32)
    return mean


def every(count: int, step: int) -> NDArray[np.intp]:
    """Return the numbers of each `step`-th of `count` rows or columns, and of the last one."""
    return np.append(np.arange(0, count - 1, step), count - 1)


def largest_of_cells(values: Floats, step: int) -> Floats:
    """Return the largest value in each block of `step` × `step` cells, fewer at the end."""
    for axis, count in enumerate(values.shape):
        values = np.maximum.reduceat(values, np.arange(0, count, step), axis=axis)
    return values


class Part(NamedTuple):
    """
    Triangles of one colour.

    Attributes
    ----------
    vertices
        m, shape (count, 3).
    faces
        Indices of vertices, shape (count, 3).

    """

    vertices: Floats
    faces: Indices


def split_by_level(
    positions: Floats, cells: Indices, values: Floats, greatest: float, levels: int
) -> list[Part | None]:
    """
    Return the triangles of a sheet by the level of the value of their cell.

    The arrays are filled up with triangles without area to a length that is a power of two: what
    shows them can then use the same memory for most states.

    Parameters
    ----------
    positions
        Of the particles, m, shape (rows, columns, 3).
    cells
        Result of `triangles`.
    values
        Of the cells, shape (rows - 1, columns - 1).
    greatest
        Values from 0 to this one are divided into levels of equal height; larger ones are in the
        last level.
    levels
        Number of levels.

    Returns
    -------
    One part per level; None without cells.

    """
    points = positions.reshape(-1, 3)
    level = np.clip(values * (levels / greatest), 0, levels - 1).astype(np.intp).ravel()
    order = np.argsort(level, kind='stable')
    ends = np.searchsorted(level[order], np.arange(levels + 1))
    faces = cells.reshape(-1, 6)[order]
    number = np.empty(len(points), np.uint32)
    parts: list[Part | None] = []
    for start, end in itertools.pairwise(ends.tolist()):
        if start == end:
            parts.append(None)
            continue
        own = faces[start:end]
        used = np.zeros(len(points), bool)
        used[own] = True
        count = int(np.count_nonzero(used))
        number[used] = np.arange(count, dtype=np.uint32)
        vertices = np.empty((_power_of_two(count), 3), np.float32)
        vertices[:count], vertices[count:] = points[used], points[own[0, 0]]
        corners = np.zeros((_power_of_two(2 * (end - start)), 3), np.uint32)
        corners[: 2 * (end - start)] = number[own].reshape(-1, 3)
        parts.append(Part(vertices, corners))
    return parts


def _power_of_two(least: int) -> int:
    return 1 << (least - 1).bit_length()
