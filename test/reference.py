"""The physics again, written as plainly as can be, to test against."""

from __future__ import annotations

import numpy as np

from cloth_ros import Scene

OFFSETS = {
    'structural': ((0, 1), (1, 0), (0, -1), (-1, 0)),
    'shear': ((1, 1), (1, -1), (-1, 1), (-1, -1)),
    'bending': ((0, 2), (2, 0), (0, -2), (-2, 0)),
}


def spring_forces(scene: Scene, p: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Hooke's law and dashpots, spring by spring; positions and velocities (rows, columns, 3)."""
    rows, columns, _ = p.shape
    dx, dy = scene.sheet.spacing
    forces = np.zeros_like(p)
    for name, offsets in OFFSETS.items():
        stiffness = getattr(scene.springs, name)
        if stiffness == 0:
            continue
        for i in range(rows):
            for j in range(columns):
                for di, dj in offsets:
                    if not (0 <= i + di < rows and 0 <= j + dj < columns):
                        continue
                    difference = p[i, j] - p[i + di, j + dj]
                    length = np.linalg.norm(difference)
                    if length == 0:
                        continue
                    direction = difference / length
                    rest = np.hypot(di * dy, dj * dx)
                    closing = (v[i, j] - v[i + di, j + dj]) @ direction
                    forces[i, j] += stiffness * (rest - length) * direction
                    forces[i, j] -= scene.springs.damping * closing * direction
    return forces


def triangles(p: np.ndarray, *, both_diagonals: bool = False) -> np.ndarray:
    """Corners of the triangles of a sheet, shape (n, 3, 3)."""
    near, right, down, far = p[:-1, :-1], p[:-1, 1:], p[1:, :-1], p[1:, 1:]
    kinds = [(near, right, down), (far, down, right)]
    if both_diagonals:
        kinds += [(near, right, far), (near, far, down)]
    return np.concatenate([np.stack(kind, axis=2).reshape(-1, 3, 3) for kind in kinds])


def _segment_distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    e = b - a
    squared = np.maximum(np.sum(e * e, axis=1), 1e-300)
    t = np.clip(-np.sum(a * e, axis=1) / squared, 0, 1)
    return np.linalg.norm(a + t[:, None] * e, axis=1)


def distances(corners: np.ndarray, centre) -> np.ndarray:
    """Distance of each triangle from a point, by another road than the model's."""
    a, b, c = (corners[:, k] - np.asarray(centre) for k in range(3))
    edges = np.minimum(
        np.minimum(_segment_distance(a, b), _segment_distance(b, c)), _segment_distance(c, a)
    )
    normal = np.cross(b - a, c - a)
    squared = np.maximum(np.sum(normal * normal, axis=1), 1e-300)
    # The foot of the perpendicular is inside if it is left of every edge.
    foot = normal * (np.sum(normal * a, axis=1) / squared)[:, None]
    inside = np.ones(len(a), bool)
    for first, second in ((a, b), (b, c), (c, a)):
        inside &= np.sum(np.cross(second - first, foot - first) * normal, axis=1) >= 0
    height = np.abs(np.sum(normal * a, axis=1)) / np.sqrt(squared)
    return np.where(inside & (squared > 1e-30), height, edges)


def crossings(corners: np.ndarray, start, direction) -> int:
    """How many triangles a ray meets."""
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
