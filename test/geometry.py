"""Geometry of sheets and triangles, independent of the contact code that is tested with it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def triangles(positions: np.ndarray, *, both_diagonals: bool = False) -> np.ndarray:
    """
    Return the corners of the triangles of a sheet, shape (n, 3, 3).

    Parameters
    ----------
    positions
        Shape (rows, columns, 3).
    both_diagonals
        True to divide each quad in both ways, which makes four triangles of it.

    """
    near, right = positions[:-1, :-1], positions[:-1, 1:]
    below, far = positions[1:, :-1], positions[1:, 1:]
    kinds = [(near, right, below), (far, below, right)]
    if both_diagonals:
        kinds += [(near, right, far), (near, far, below)]
    return np.concatenate([np.stack(kind, axis=2).reshape(-1, 3, 3) for kind in kinds])


def _segment_distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the distances of segments from the origin."""
    e = b - a
    squared = np.maximum(np.sum(e * e, axis=1), 1e-300)
    t = np.clip(-np.sum(a * e, axis=1) / squared, 0, 1)
    return np.linalg.norm(a + t[:, None] * e, axis=1)


def triangle_distances(corners: np.ndarray, point: ArrayLike) -> np.ndarray:
    """Return the distances, shape (n,), of triangles with `corners` (n, 3, 3) from a point."""
    a, b, c = (corners[:, k] - np.asarray(point) for k in range(3))
    edges = np.min([_segment_distances(*ends) for ends in ((a, b), (b, c), (c, a))], axis=0)
    normal = np.cross(b - a, c - a)
    squared = np.maximum(np.sum(normal * normal, axis=1), 1e-300)
    # The foot of the perpendicular is inside if it is left of every edge.
    foot = normal * (np.sum(normal * a, axis=1) / squared)[:, None]
    inside = np.ones(len(a), bool)
    for first, second in ((a, b), (b, c), (c, a)):
        inside &= np.sum(np.cross(second - first, foot - first) * normal, axis=1) >= 0
    height = np.abs(np.sum(normal * a, axis=1)) / np.sqrt(squared)
    return np.where(inside & (squared > 1e-30), height, edges)


def ray_crossings(corners: np.ndarray, start: ArrayLike, direction: ArrayLike) -> int:
    """Return how many triangles with `corners` (n, 3, 3) a ray meets."""
    direction = np.asarray(direction, float)
    a = corners[:, 0] - np.asarray(start)
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction, f)
    determinant = np.sum(e * p, axis=1)
    with np.errstate(all='ignore'):
        u = -np.sum(a * p, axis=1) / determinant
        q = np.cross(-a, e)
        v = np.sum(direction * q, axis=1) / determinant
        t = np.sum(f * q, axis=1) / determinant
    return int(np.sum((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)))
