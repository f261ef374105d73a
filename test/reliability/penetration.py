"""
Depth of a sheet in colliders, from the true shapes alone; independent of the code of contact.

Shapes are signed distances in NumPy; that of a convex mesh is bounded by its faces, that of
another one is measured from its triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from geometry import ray_crossings, triangle_distances

from cloth_ros.model.contact.collider import Collider

Distance = Callable[[np.ndarray], np.ndarray]  # of points, m, shape (n, 3)
_LEVELS, _MOST = 8, 30_000  # of subdivision, and triangles in one of them


def rotation(quaternion: tuple[float, ...]) -> np.ndarray:
    """Return the rotation matrix of a unit quaternion x y z w: the columns are turned axes."""
    vector, w = np.array(quaternion[:3]), quaternion[3]
    cross = np.cross(np.eye(3), vector)
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def _beyond_faces(over: np.ndarray) -> np.ndarray:
    """Return distances from a product of intervals; over: beyond the ends of each, (n, axes)."""
    outside = np.linalg.norm(np.maximum(over, 0), axis=1)
    return np.where(over.max(axis=1) > 0, outside, over.max(axis=1))


def _mesh_distance(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offsets = np.sum(normals * corners[:, 0], axis=1)
    size = np.abs(corners).max()
    beyond = points @ normals.T - offsets
    if (corners.reshape(-1, 3) @ normals.T - offsets).max() < 1e-6 * size:
        return beyond.max(axis=1)  # convex: exact inside, and a lower bound outside
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    result = _beyond_faces(np.maximum(low - points, points - high))
    direction = np.array([0.48, 0.6, 0.64])
    for n in np.flatnonzero(result <= 0):  # beyond that, a lower bound
        distance = triangle_distances(corners, points[n]).min()
        inside = ray_crossings(corners, points[n], direction) % 2
        result[n] = -distance if inside else distance
    return result


def distance_of(collider: Collider) -> Distance:
    """Return the signed distance from a collider in the world, m; negative inside."""
    it, axes = collider.parameters, rotation(collider.orientation)
    place = np.array(collider.position)

    def local(points: np.ndarray) -> np.ndarray:
        return (points - place) @ axes

    def cylinder(p: np.ndarray) -> np.ndarray:
        barrel = np.hypot(p[:, 0], p[:, 1]) - it.radius
        return _beyond_faces(np.stack([barrel, np.abs(p[:, 2]) - it.length / 2], axis=1))

    def capsule(p: np.ndarray) -> np.ndarray:
        z = p[:, 2] - np.clip(p[:, 2], -it.length / 2, it.length / 2)
        return np.linalg.norm(np.stack([p[:, 0], p[:, 1], z], axis=1), axis=1) - it.radius

    shapes: dict[str, Distance] = {
        'plane': lambda p: p[:, 2],
        'sphere': lambda p: np.linalg.norm(p, axis=1) - it.radius,
        'box': lambda p: _beyond_faces(np.abs(p) - np.array(it.size) / 2),
        'capsule': capsule,
        'cylinder': cylinder,
        'mesh': lambda p: _mesh_distance(np.asarray(collider.mesh_triangles), p),
    }
    shape = shapes[collider.type]
    return lambda points: shape(local(points))


def half_width(collider: Collider) -> float:
    """Return the radius, m, or half of the shortest edge; inf for a plane."""
    it = collider.parameters
    if collider.type == 'plane':
        return np.inf
    if collider.type == 'box':
        return min(it.size) / 2
    if collider.type == 'mesh':
        triangles = np.asarray(collider.mesh_triangles)
        if len(triangles) > 50:
            extents = triangles.reshape(-1, 3)
            return float((extents.max(axis=0) - extents.min(axis=0)).min()) / 2
        edges = triangles - np.roll(triangles, 1, axis=1)
        return float(np.linalg.norm(edges, axis=2).min()) / 2
    if collider.type == 'cylinder':
        return min(it.radius, it.length / 2)
    return it.radius


class Overlap(NamedTuple):
    """Points of the sheet in a collider, the deepest of each triangle."""

    depth: np.ndarray  # m, shape (n,)
    triangles: np.ndarray  # numbers, shape (n,)
    points: np.ndarray  # m, shape (n, 3)


def overlap(corners: np.ndarray, distance: Distance, tolerance: float) -> Overlap:
    """
    Find the triangles that are deeper in a shape than `tolerance`, m, by subdivision.

    Parameters
    ----------
    corners
        Of the triangles, m, shape (n, 3, 3).
    distance
        From the shape; no point is nearer to another than their distances differ.
    tolerance
        m.

    """
    number, parts = np.arange(len(corners)), corners.astype(float)
    deepest = np.full(len(corners), -np.inf)
    place = np.zeros((len(corners), 3))

    def sample(numbers: np.ndarray, points: np.ndarray) -> np.ndarray:
        depth = -distance(points)
        order = np.argsort(depth, kind='stable')
        better = order[depth[order] > deepest[numbers[order]]]
        deepest[numbers[better]], place[numbers[better]] = depth[better], points[better]
        return depth

    for level in range(_LEVELS):
        centres = parts.mean(axis=1)
        reach = np.linalg.norm(parts - centres[:, None], axis=2).max(axis=1)
        depth = sample(number, centres)
        keep = depth + reach > np.maximum(deepest[number] + 0.1 * tolerance, tolerance)
        if level == 0:
            near = np.flatnonzero(depth + reach > tolerance)
            for k in range(3):
                sample(number[near], parts[near, k])
        parts, number = parts[keep], number[keep]
        if not len(parts) or len(parts) > _MOST:
            break
        a, b, c = parts[:, 0], parts[:, 1], parts[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        parts = np.concatenate([np.stack(each, axis=1) for each in quarters])
        number = np.tile(number, 4)
    found = np.flatnonzero(deepest > tolerance)
    return Overlap(deepest[found], found, place[found])


def normal(distance: Distance, point: np.ndarray, step: float) -> np.ndarray:
    """Return the direction in which the distance from a shape grows, by differences."""
    steps = step * np.eye(3)
    gradient = distance(point + steps) - distance(point - steps)
    length = float(np.linalg.norm(gradient))
    return gradient / length if length > 0 else gradient


def is_pressed(
    points: np.ndarray, point: np.ndarray, one: Distance, other: Distance, near: float
) -> bool:
    """
    Tell if another collider presses a part of the sheet from a different side.

    It does if it is no farther from that part than `near`, m, and its normal there and that of
    the first collider at `point` are more than 90 degrees apart.  With a smaller angle there is
    room for the sheet beside both.

    Parameters
    ----------
    points
        Of the part, m, shape (n, 3).
    point
        The deepest one, m, shape (3,).
    one, other
        Distances from the colliders.
    near
        m.

    """
    gaps = other(points)
    step = 1e-4 * near
    here = normal(one, point, step)
    # Several sides of the other one may touch the part.
    return any(here @ normal(other, each, step) < 0 for each in points[gaps < near])
