"""The physics again, written as plainly as can be, to test against."""

from __future__ import annotations

import numpy as np

from cloth_ros import Scene

OFFSETS = {
    'structural': ((0, 1), (1, 0)),
    'shear': ((1, 1), (1, -1)),
    'bending': ((0, 2), (2, 0)),
}


class Equations:
    """The equations of motion of a scene; positions and velocities (rows, columns, 3)."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        rows, columns = scene.sheet.rows, scene.sheet.columns
        number = np.arange(rows * columns).reshape(rows, columns)
        springs = []
        for name, offsets in OFFSETS.items():
            stiffness = getattr(scene.springs, name)
            if stiffness == 0:
                continue
            for i, j in np.ndindex(rows, columns):
                for di, dj in offsets:
                    if i + di < rows and 0 <= j + dj < columns:
                        dx, dy = scene.sheet.spacing
                        rest = np.hypot(di * dy, dj * dx)
                        springs.append((number[i, j], number[i + di, j + dj], stiffness, rest))
        spring_ends = np.array([spring[:2] for spring in springs], int).reshape(-1, 2)
        self._first, self._second = spring_ends.T
        values = np.array([spring[2:] for spring in springs]).reshape(-1, 2)
        self._stiffness, self._rest = values.T
        places = np.repeat(number[..., None], 3, axis=-1)
        self._corners = triangles(places)[..., 0]

    def springs(self, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Hooke's law and dashpots, N."""
        flat_p, flat_v = p.reshape(-1, 3), v.reshape(-1, 3)
        difference = flat_p[self._first] - flat_p[self._second]
        length = np.linalg.norm(difference, axis=1)
        direction = difference / np.where(length > 0, length, 1)[:, None]
        closing = np.sum((flat_v[self._first] - flat_v[self._second]) * direction, axis=1)
        tension = self._stiffness * (self._rest - length) - self._scene.springs.damping * closing
        forces = np.zeros_like(flat_p)
        np.add.at(forces, self._first, tension[:, None] * direction)
        np.add.at(forces, self._second, -tension[:, None] * direction)
        return forces.reshape(p.shape)

    def air(self, p: np.ndarray, v: np.ndarray, wind: np.ndarray) -> np.ndarray:
        """Air on the triangles, N, a third at each corner, with the velocity of that corner."""
        a, b, c = (p.reshape(-1, 3)[corner] for corner in self._corners.T)
        area = np.cross(b - a, c - a) / 2
        size = np.linalg.norm(area, axis=1)
        normal = area / size[:, None]
        forces = np.zeros_like(p.reshape(-1, 3))
        for corner in self._corners.T:
            u = wind - v.reshape(-1, 3)[corner]
            pressure = 0.5 * self._scene.wind.air_density * self._scene.wind.drag_coefficient
            pressure = pressure * np.linalg.norm(u, axis=1) * np.sum(u * normal, axis=1)
            np.add.at(forces, corner, (pressure * size / 3)[:, None] * normal)
        return forces.reshape(p.shape)

    def acceleration(self, p: np.ndarray, v: np.ndarray, wind: np.ndarray) -> np.ndarray:
        """Of every particle by springs, dashpots, gravity, drag and air, m/s²."""
        scene = self._scene
        forces = self.springs(p, v) + self.air(p, v, wind)
        acceleration = forces / scene.sheet.particle_mass + np.array(scene.gravity)
        return (acceleration - scene.drag * v) * ~scene.pinned()[..., None]


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
