"""
Reference implementation of the physics in plain NumPy.

The forces are those that `model.forces.springs` and `model.forces.aerodynamics` define, written
once more in full arrays, without the spring table and the compiled kernels of the model.  Tests
compare the model with it, the study computes the work of forces from it, and the reliability runs
compare the model with its explicit simulation.

Arrays have the shape (3, rows, columns); results have the dtype of the positions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..model.forces.gusts import Gusts
from ..model.grid import Array
from ..scene import Scene

# Lengths, m, and areas, m², below which a spring has no direction and cloth no normal.
_SHORTEST = 1e-12
_SMALLEST = 1e-24


def _spring_kinds(scene: Scene) -> list[tuple[int, int, float, float]]:
    """Return rows apart, columns apart, stiffness [N/m] and rest length [m] of the springs."""
    dx, dy = scene.sheet.spacing
    springs = scene.springs
    return [
        (0, 1, springs.structural, dx),
        (1, 0, springs.structural, dy),
        (1, 1, springs.shear, math.hypot(dx, dy)),
        (1, -1, springs.shear, math.hypot(dx, dy)),
        (0, 2, springs.bending, 2 * dx),
        (2, 0, springs.bending, 2 * dy),
    ]


def tributary_areas(rows: int, columns: int) -> Array:
    """Return how many cells' area belongs to each particle, shape (rows, columns)."""
    areas = np.ones((rows, columns))
    for count, edges in ((rows, areas), (columns, areas.T)):
        if count > 1:
            edges[[0, -1]] /= 2
    return areas


def _dot(a: Array, b: Array) -> Array:
    product: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def spring_forces(scene: Scene, positions: Array, velocities: Array) -> Array:
    """
    Return the forces of springs and dashpots, N, shape (3, rows, columns).

    Parameters
    ----------
    scene
        Its springs.
    positions, velocities
        m and m/s, shape (3, rows, columns).

    """
    forces = np.zeros_like(positions)
    rows, columns = positions.shape[1:]
    strips = tributary_areas(rows, columns)
    for down, across, stiffness, rest_length in _spring_kinds(scene):
        if stiffness == 0 or down >= rows or abs(across) >= columns:
            continue
        # From each particle that has a neighbour `down` rows and `across` columns further on.
        left, right = max(-across, 0), max(across, 0)
        here = np.s_[:, : rows - down, left : columns - right]
        there = np.s_[:, down:, right : columns - left]
        difference = positions[here] - positions[there]
        length = np.sqrt(_dot(difference, difference))
        difference /= np.maximum(length, _SHORTEST)
        force = stiffness * (rest_length - length)
        if scene.springs.damping > 0:
            force -= scene.springs.damping * _dot(velocities[here] - velocities[there], difference)
        # Half of the strip of cloth that a spring along an edge stands for is missing.
        if down == 0:
            force *= 2 * strips[:, :1]
        elif across == 0:
            force *= 2 * strips[:1]
        difference *= force
        forces[here] += difference
        forces[there] -= difference
    return forces


def air_forces(
    scene: Scene, positions: Array, velocities: Array, air_velocity: ArrayLike
) -> Array:
    """
    Return the forces of the air, N, shape (3, rows, columns).

    At each particle that on a quarter of each cell around it, with the normal from its neighbours.

    Parameters
    ----------
    scene
        Its air.
    positions, velocities
        m and m/s, shape (3, rows, columns).
    air_velocity
        m/s, shape (3,).

    """
    forces = np.zeros_like(positions)
    density = 0.5 * scene.wind.air_density * scene.wind.drag_coefficient
    if density == 0:
        return forces
    flow = np.asarray(air_velocity, positions.dtype)[:, None, None] - velocities
    speed = np.sqrt(_dot(flow, flow))
    # The differences of the neighbours, with the particle itself where one is missing.
    padded = np.pad(positions, ((0, 0), (1, 1), (1, 1)), mode='edge')
    along = (padded[:, 1:-1, 2:] - padded[:, 1:-1, :-2]) / 2
    down = (padded[:, 2:, 1:-1] - padded[:, :-2, 1:-1]) / 2
    area = np.cross(along, down, axis=0)
    normal = area / np.maximum(np.sqrt(_dot(area, area)), _SMALLEST)
    forces += density * speed * _dot(flow, normal) * area
    return forces


def acceleration(
    scene: Scene, positions: Array, velocities: Array, air_velocity: ArrayLike = (0.0, 0.0, 0.0)
) -> Array:
    """
    Return the acceleration by all forces but contact, m/s², shape (3, rows, columns).

    Springs, dashpots, gravity, drag and air; zero for pinned particles.

    Parameters
    ----------
    scene
        Its forces, masses and pins.
    positions, velocities
        m and m/s, shape (3, rows, columns).
    air_velocity
        m/s, shape (3,).

    """
    total = spring_forces(scene, positions, velocities)
    if scene.wind.air_density > 0:
        total += air_forces(scene, positions, velocities, air_velocity)
    total /= scene.sheet.cell_mass * tributary_areas(*positions.shape[1:])
    total += np.array(scene.gravity, positions.dtype)[:, None, None]
    if scene.drag > 0:
        total -= scene.drag * velocities
    total[:, scene.pinned()] = 0
    return total


class ExplicitCloth:
    """
    Explicit simulation as most tutorials and many engines have it: symplectic Euler.

    Nothing bounds the step or checks the energy.  Particles that are inside the sphere after a
    step are put on its surface, and lose their velocity towards it.

    Parameters
    ----------
    scene
        Its parameters; those of `solver` have no effect.
    positions, velocities
        To start from, m and m/s, shape (3, rows, columns).
    steps_per_tick
        In a tick of the scene's rate.
    time
        Of the start, s; gusts depend on it.

    Attributes
    ----------
    scene
        May be replaced by one of the same grid.
    positions, velocities
        m and m/s, shape (3, rows, columns).
    step
        Length of the steps, s.
    time
        s.
    sphere_position
        m, shape (3,).

    """

    def __init__(
        self,
        scene: Scene,
        positions: Array,
        velocities: Array,
        *,
        steps_per_tick: int,
        time: float = 0.0,
    ) -> None:
        self.scene = scene
        self.positions, self.velocities = positions.copy(), velocities.copy()
        self.step = 1 / (scene.rate * steps_per_tick)
        self.time = time
        self.sphere_position = np.array(scene.sphere.position)

    def advance(
        self,
        seconds: float,
        *,
        wind: ArrayLike | None = None,
        sphere_position: ArrayLike | None = None,
    ) -> None:
        """
        Advance by whole steps, at least one, as long as all velocities are finite.

        Parameters
        ----------
        seconds
            s.
        wind
            m/s, shape (3,), without gusts; None: that of the scene.
        sphere_position
            Where the sphere is at the end, m, shape (3,); None: it stays.

        """
        scene, h = self.scene, self.step
        constant = np.array(scene.wind.velocity if wind is None else wind)
        gusts = Gusts(scene.wind.gust) if scene.wind.gust.period > 0 else None
        begin = self.sphere_position
        end = begin if sphere_position is None else np.array(sphere_position)
        count = max(round(seconds / h), 1)
        for n in range(1, count + 1):
            air = constant if gusts is None else constant + gusts.velocity(self.time)
            self.velocities += h * acceleration(scene, self.positions, self.velocities, air)
            self.positions += h * self.velocities
            self.time += h
            self.sphere_position = begin + (end - begin) * n / count
            if scene.sphere.radius > 0:
                self._push_out()
            if not np.isfinite(self.velocities).all():
                return

    def _push_out(self) -> None:
        radius = self.scene.sphere.radius
        centre = self.sphere_position[:, None, None]
        way = self.positions - centre
        distance = np.sqrt(_dot(way, way))
        inside = (distance < radius) & ~self.scene.pinned()
        normal = way / np.maximum(distance, _SHORTEST)
        inward = np.minimum(_dot(self.velocities, normal), 0.0)
        self.positions = np.where(inside, centre + radius * normal, self.positions)
        self.velocities = np.where(inside, self.velocities - inward * normal, self.velocities)

    @property
    def finite(self) -> bool:
        """True if every position and velocity is finite."""
        return bool(np.isfinite(self.positions).all() and np.isfinite(self.velocities).all())
