"""Colliders of every type for the tests, with signed distances of their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import meshes
import numpy as np
import pytest
from geometry import triangles

from cloth_ros import Cloth

Distance = Callable[[np.ndarray], np.ndarray]
NAME = 'solid'  # of the collider in all scenes
SHAPES = ('plane', 'sphere', 'box', 'capsule', 'cylinder', 'mesh')
CLOSED = SHAPES[1:]


def each_shape(shapes: Sequence[str] = SHAPES) -> list[object]:
    """Return shapes as parameters of tests: of a mesh, with kernels of its own, of slow ones."""
    slow = pytest.mark.slow
    return [pytest.param(shape, marks=slow) if shape == 'mesh' else shape for shape in shapes]


# Colliders that nothing reaches: each set of shapes has kernels of its own, which take seconds to
# compile, and with these the tests of all shapes but the mesh share one.
FAR: dict[str, dict[str, object]] = {
    'far_plane': {'type': 'plane', 'position': (0, 0, -900)},
    'far_sphere': {'type': 'sphere', 'radius': 0.1, 'position': (900, 0, 0)},
    'far_box': {'type': 'box', 'size': (0.1, 0.1, 0.1), 'position': (900, 0, 0)},
    'far_capsule': {'type': 'capsule', 'radius': 0.1, 'length': 0.1, 'position': (900, 0, 0)},
    'far_cylinder': {'type': 'cylinder', 'radius': 0.1, 'length': 0.1, 'position': (900, 0, 0)},
}
ROUNDING = 2e-6  # m, of positions in single precision, about a metre


@dataclass(frozen=True)
class Solid:
    """
    A collider in its own frame.

    Attributes
    ----------
    parameters
        Type and lengths, as parameters of the scene.
    distance
        Signed distances, m, shape (n,), of points, shape (n, 3); negative inside.
    inner_radius
        Of the largest ball inside, m.
    inside
        A point well inside, m.
    top
        Height of the surface above the origin, m, in the direction of z.

    """

    parameters: dict[str, object]
    distance: Distance
    inner_radius: float
    inside: tuple[float, float, float] = (0.0, 0.0, 0.0)
    top: float = 0.0

    @property
    def tolerance(self) -> float:
        """Greatest depth that contact may leave, m."""
        return min(1e-4, 0.01 * self.inner_radius) + ROUNDING

    def scene(
        self,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        friction: float = 0.3,
    ) -> dict[str, object]:
        """Return parameters of a scene with this collider, for `cloth_of`."""
        pose = {'position': position, 'orientation': orientation, 'friction': friction}
        far = FAR
        if self.parameters['type'] == 'mesh':  # whose kernels take longest
            far = {'far_sphere': FAR['far_sphere']}
        return {'collider': {'names': [NAME, *far], NAME: {**self.parameters, **pose}, **far}}


def solid(shape: str, size: float, folder: Path) -> Solid:
    """
    Return a collider.

    Parameters
    ----------
    shape
        Of `SHAPES`.
    size
        Radius, or half of an edge, m.
    folder
        Receives the file of a mesh.

    """
    if shape == 'plane':
        return Solid({'type': 'plane'}, lambda p: p[:, 2], math.inf, (0, 0, -1.0))
    if shape == 'sphere':
        return Solid({'type': shape, 'radius': size}, _capsule(size, 0.0), size, top=size)
    if shape == 'box':
        edges = (2 * size, 1.8 * size, 1.6 * size)
        return Solid({'type': shape, 'size': edges}, _box(edges), 0.8 * size, top=0.8 * size)
    if shape == 'capsule':
        values = {'type': shape, 'radius': size, 'length': 2 * size}
        return Solid(values, _capsule(size, 2 * size), size, top=2 * size)
    if shape == 'cylinder':
        values = {'type': shape, 'radius': size, 'length': 2 * size}
        return Solid(values, _cylinder(size, 2 * size), size, top=size)
    corners = meshes.angle_section(2 * size, 0.8 * size, 1.6 * size)
    corners -= np.array([size, size, 0])
    path = folder / f'angle_{size!r}.stl'
    path.write_bytes(meshes.binary_stl(corners))
    stored = corners.astype('<f4').astype(float)
    return Solid(
        {'type': 'mesh', 'mesh': str(path)},
        lambda points: mesh_distance(points, stored),
        0.4 * size,
        (-0.6 * size, -0.6 * size, 0.0),
        0.8 * size,
    )


def _box(size: Sequence[float]) -> Distance:
    half = 0.5 * np.array(size)

    def distance(points: np.ndarray) -> np.ndarray:
        beyond = np.abs(points) - half
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
        return outside + np.minimum(beyond.max(axis=1), 0)

    return distance


def _capsule(radius: float, length: float) -> Distance:
    def distance(points: np.ndarray) -> np.ndarray:
        z = points[:, 2] - np.clip(points[:, 2], -length / 2, length / 2)
        return np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2 + z**2) - radius

    return distance


def _cylinder(radius: float, length: float) -> Distance:
    def distance(points: np.ndarray) -> np.ndarray:
        wide = np.hypot(points[:, 0], points[:, 1]) - radius
        high = np.abs(points[:, 2]) - length / 2
        outside = np.hypot(np.maximum(wide, 0), np.maximum(high, 0))
        return outside + np.minimum(np.maximum(wide, high), 0)

    return distance


def mesh_distance(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """
    Return signed distances, shape (n,), of points from a closed mesh, by all its triangles.

    The sign is that of the winding number, from the solid angles of the triangles
    (A. van Oosterom, J. Strackee, "The Solid Angle of a Plane Triangle", 1983).
    """
    found = []
    for some in np.array_split(points, max(len(points) * len(corners) // 200_000, 1)):
        a, b, c = (corners[None, :, k] - some[:, None] for k in range(3))
        p, q, r = (np.linalg.norm(each, axis=2) for each in (a, b, c))
        volume = np.sum(a * np.cross(b, c), axis=2)
        scale = p * q * r + np.sum(a * b, axis=2) * r
        scale += np.sum(b * c, axis=2) * p + np.sum(c * a, axis=2) * q
        winding = np.arctan2(volume, scale).sum(axis=1) / (2 * math.pi)
        nearest = np.full(volume.shape, math.inf)
        normal = np.cross(b - a, c - a)
        area = np.maximum(np.linalg.norm(normal, axis=2), 1e-300)
        height = np.sum(normal * a, axis=2) / area
        foot = normal * (height / area)[..., None]
        over = np.ones(volume.shape, bool)
        for one, two in ((a, b), (b, c), (c, a)):
            edge = two - one
            t = -np.sum(one * edge, axis=2) / np.maximum(np.sum(edge**2, axis=2), 1e-300)
            gap = np.linalg.norm(one + np.clip(t, 0, 1)[..., None] * edge, axis=2)
            nearest = np.minimum(nearest, gap)
            over &= np.sum(np.cross(edge, foot - one) * normal, axis=2) >= 0
        nearest = np.where(over & (area > 1e-20), np.minimum(nearest, np.abs(height)), nearest)
        found.append(nearest.min(axis=1) * np.where(winding > 0.5, -1, 1))
    return np.concatenate(found)


# Geometry


def matrix(quaternion: Sequence[float]) -> np.ndarray:
    """Return the rotation matrix of a unit quaternion x y z w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def turn(axis: Sequence[float], angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion x y z w of a turn by `angle`, rad, about an axis."""
    x, y, z = math.sin(angle / 2) * np.array(axis, float) / np.linalg.norm(axis)
    return (float(x), float(y), float(z), math.cos(angle / 2))


def to_local(cloth: Cloth, points: np.ndarray, name: str = NAME) -> np.ndarray:
    """Return points, shape (..., 3), in the present frame of a collider."""
    collider = cloth.colliders[name]
    return (points - np.array(collider.position)) @ matrix(collider.orientation)


def deepest(parts: np.ndarray, distance: Distance, tolerance: float, *, levels: int) -> float:
    """
    Return the greatest depth of triangles, m, shape (n, 3, 3), negative if all are outside.

    A triangle is divided by 4 as long as a part of it may be deeper than what was found so far and
    than the tolerance, m, but at most `levels` times: the distance changes by no more than a point
    moves.
    """
    found = -float(distance(parts.reshape(-1, 3)).min())
    for _ in range(levels):
        centres = parts.mean(axis=1)
        reach = np.linalg.norm(parts - centres[:, None], axis=2).max(axis=1)
        depths = -distance(centres)
        found = max(found, float(depths.max()))
        parts = parts[depths + reach > found + tolerance]
        if not len(parts):
            break
        a, b, c = parts[:, 0], parts[:, 1], parts[:, 2]
        p, q, r = (a + b) / 2, (b + c) / 2, (c + a) / 2
        divided = [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
        parts = np.concatenate([np.stack(each, axis=1) for each in divided])
    return found


def depth(cloth: Cloth, solid: Solid, name: str = NAME) -> float:
    """
    Return the depth of the triangles of a sheet, m, whichever diagonal divides its quads.

    Less than the tolerance of the collider is not exact; it is negative where nothing touches.
    """
    parts = to_local(cloth, triangles(cloth.positions, both_diagonals=True), name)
    if solid.parameters['type'] == 'plane':  # a corner is the deepest
        return -float(solid.distance(parts.reshape(-1, 3)).min())
    return deepest(parts, solid.distance, 0.1 * solid.tolerance, levels=6)


def product(p: Sequence[float], q: Sequence[float]) -> tuple[float, float, float, float]:
    """Return the quaternion x y z w of the turn q followed by the turn p."""
    first, second = np.array(q[:3]), np.array(p[:3])
    x, y, z = p[3] * first + q[3] * second + np.cross(second, first)
    return (float(x), float(y), float(z), float(p[3] * q[3] - first @ second))
