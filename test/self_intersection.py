"""Find triangles of a sheet that intersect, independently of the model: NumPy alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[Any]


def sheet_triangles(rows: int, columns: int) -> Array:
    """Return the corners of the triangles of a sheet, as published: shape (n, 3)."""
    index = np.arange(rows * columns).reshape(rows, columns)
    first, right = index[:-1, :-1], index[:-1, 1:]
    below, last = index[1:, :-1], index[1:, 1:]
    halves = [np.stack([first, right, below], -1), np.stack([last, below, right], -1)]
    return np.concatenate([half.reshape(-1, 3) for half in halves])


def _edges(triangles: Array) -> Array:
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges: Array = np.unique(np.sort(pairs, axis=1), axis=0)
    return edges


def intersecting_edges(positions: Array, triangles: Array | None = None) -> Array:
    """
    Return edges of a sheet that pierce a triangle with which they share no corner.

    Two triangles in general position intersect only if an edge of one pierces the other.

    Parameters
    ----------
    positions
        m, shape (rows, columns, 3).
    triangles
        Corners, shape (n, 3); None: those that are published.

    Returns
    -------
    Array
        Two ends of the edge and three corners of the triangle, shape (n, 5).

    """
    rows, columns, _ = positions.shape
    points = np.asarray(positions, float).reshape(-1, 3)
    if triangles is None:
        triangles = sheet_triangles(rows, columns)
    edges = _edges(triangles)
    ends, corners = points[edges], points[triangles]
    middles, centres = ends.mean(axis=1), corners.mean(axis=1)
    half = 0.5 * np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max()
    radius = np.linalg.norm(corners - centres[:, None], axis=2).max()
    found = cKDTree(middles).sparse_distance_matrix(
        cKDTree(centres), half + radius, output_type='coo_matrix'
    )
    e, t = found.row, found.col
    shared = (edges[e][:, :, None] == triangles[t][:, None, :]).any(axis=(1, 2))
    e, t = e[~shared], t[~shared]
    p, q = ends[e, 0], ends[e, 1]
    a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]

    def volume(u: Array, v: Array, w: Array, x: Array) -> Array:
        product: Array = np.einsum('ij,ij->i', np.cross(v - u, w - u), x - u)
        return product

    sides = volume(a, b, c, p) * volume(a, b, c, q) < 0
    around = np.stack([volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)])
    inside = (around > 0).all(axis=0) | (around < 0).all(axis=0)
    pierced = sides & inside
    return np.column_stack([edges[e[pierced]], triangles[t[pierced]]])
