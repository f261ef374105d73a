"""
A plain cloth, to compare with: the same forces in NumPy, explicit steps of one length.

Symplectic Euler, as in most tutorials and many engines.  Nothing bounds the step, looks at the
energy, or sweeps the sphere: particles inside it are put back on its surface after each step.
"""

from __future__ import annotations

import numpy as np

from cloth_ros import Cloth, Scene
from cloth_ros.model.forces.gusts import Gusts
from cloth_ros.model.forces.springs import spring_ends, spring_families
from cloth_ros.model.grid import Array

_TINY = 1e-12  # m


class PlainCloth:
    """
    A cloth that takes so many steps a tick, come what may.

    Parameters
    ----------
    cloth
        Whose scene and state to begin with.
    steps
        In a tick of the scene's rate.

    Attributes
    ----------
    positions, velocities
        m and m/s, shape (3, rows, columns).

    """

    def __init__(self, cloth: Cloth, steps: int) -> None:
        self.positions = np.moveaxis(cloth.positions, -1, 0).copy()
        self.velocities = np.moveaxis(cloth.velocities, -1, 0).copy()
        self.step = 1 / (cloth.scene.rate * steps)
        self.take(cloth)

    def take(self, cloth: Cloth) -> None:
        """Take over the scene of a cloth and what it was told."""
        self._scene: Scene = cloth.scene
        self._free = ~cloth.scene.pinned()
        self._velocity = np.array(cloth.wind)
        self._centre = np.array(cloth.sphere_position)
        gust = cloth.scene.wind.gust
        self._gusts = Gusts(gust) if gust.period > 0 else None
        self._time = cloth.time

    def _springs(self) -> Array:
        force = np.zeros_like(self.positions)
        damping = self._scene.springs.damping
        for family in spring_families(self._scene):
            first, second = spring_ends(family, self.positions)
            way = first - second
            length = np.sqrt(np.sum(way * way, axis=0))
            direction = way / np.maximum(length, _TINY)
            u, v = spring_ends(family, self.velocities)
            closing = np.sum((u - v) * direction, axis=0)
            pull = (
                family.stiffness * (family.rest_length - length) - damping * closing
            ) * direction
            left, right = spring_ends(family, force)
            left += pull
            right -= pull
        return force

    def _air(self) -> Array:
        force = np.zeros_like(self.positions)
        wind = self._scene.wind
        pressure = 0.5 * wind.air_density * wind.drag_coefficient
        velocity = self._velocity + (self._gusts.velocity(self._time) if self._gusts else 0.0)
        flow = velocity[:, None, None] - self.velocities
        p = self.positions
        for corners in (
            (np.s_[:, :-1, :-1], np.s_[:, :-1, 1:], np.s_[:, 1:, :-1]),
            (np.s_[:, 1:, 1:], np.s_[:, 1:, :-1], np.s_[:, :-1, 1:]),
        ):
            a, b, c = (p[corner] for corner in corners)
            area = np.cross(b - a, c - a, axis=0) / 2
            size = np.maximum(np.sqrt(np.sum(area * area, axis=0)), _TINY**2)
            for corner in corners:
                u = flow[corner]
                speed = np.sqrt(np.sum(u * u, axis=0))
                force[corner] += pressure * speed * np.sum(u * area, axis=0) / size * area / 3
        return force

    def advance(self, seconds: float, sphere: Array) -> None:
        """Advance by whole steps, at least one; the sphere moves to `sphere`, m, at the end."""
        count = max(round(seconds / self.step), 1)
        scene, h = self._scene, self.step
        for n in range(count):
            force = self._springs()
            if scene.has_air:
                force += self._air()
            acceleration = force / scene.sheet.particle_mass
            acceleration += np.array(scene.gravity)[:, None, None] - scene.drag * self.velocities
            self.velocities += h * acceleration * self._free
            self.positions += h * self.velocities
            self._time += h
            if scene.sphere.radius > 0:
                self._push_out(self._centre + (sphere - self._centre) * (n + 1) / count)
            if not np.isfinite(self.velocities).all():
                return

    def _push_out(self, centre: Array) -> None:
        way = self.positions - centre[:, None, None]
        distance = np.maximum(np.sqrt(np.sum(way * way, axis=0)), _TINY)
        inside = (distance < self._scene.sphere.radius) & self._free
        normal = way / distance
        on_surface = centre[:, None, None] + self._scene.sphere.radius * normal
        inward = np.minimum(np.sum(self.velocities * normal, axis=0), 0.0)
        self.positions = np.where(inside, on_surface, self.positions)
        self.velocities = np.where(inside, self.velocities - inward * normal, self.velocities)

    @property
    def finite(self) -> bool:
        """True if every position and velocity is finite."""
        return bool(np.isfinite(self.positions).all() and np.isfinite(self.velocities).all())
