"""
A plain NumPy step with array slices: what one writes by hand before reaching for an engine.

Position Verlet in single precision, in as few substeps as Cloth takes.  Each of the six families
of springs is one pass over whole slices, with all temporaries made beforehand, which is what
NumPy's own notes on performance advise: no loops, `out=`, no copies.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import sheets

NAME = 'NumPy slices'

_TICK = 1 / 60


def version() -> str:
    """Return the version of NumPy."""
    return np.__version__


class _Springs:
    """All springs of one offset: views of both of their ends, and room for temporaries."""

    def __init__(self, family: Any, mass: float, position: Any, force: Any) -> None:
        from cloth_ros.model.forces.springs import spring_ends

        self._near, self._far = spring_ends(family, position)
        self._force_near, self._force_far = spring_ends(family, force)
        self._stiffness = np.float32(family.stiffness / mass)
        self._tension = np.float32(family.stiffness / mass * family.rest_length)
        self._along = np.empty(self._near.shape, np.float32)
        self._square = np.empty_like(self._along)
        self._scale = np.empty(self._near.shape[1:], np.float32)

    def pull(self) -> None:
        """Add the pull per unit mass, d (k L / |d| - k), to one end and take it off the other."""
        along, square, scale = self._along, self._square, self._scale
        np.subtract(self._near, self._far, out=along)
        np.multiply(along, along, out=square)
        np.add(square[0], square[1], out=scale)
        scale += square[2]
        np.sqrt(scale, out=scale)
        np.divide(self._tension, scale, out=scale)
        scale -= self._stiffness
        along *= scale
        self._force_near += along
        self._force_far -= along


class Sheet:
    """The benchmark's sheet of `size` × `size` particles."""

    def __init__(self, size: int) -> None:
        from cloth_ros.model.forces.springs import spring_families
        from cloth_ros.model.time_step import substep_length

        scene = sheets.scene(size)
        self.substeps = round(_TICK / substep_length(scene))
        self.settings = f'position Verlet, float32, {self.substeps} substeps a tick'
        self._h = np.float32(_TICK / self.substeps)
        self._gravity = np.float32(scene.gravity[2])

        line = np.linspace(-0.5, 0.5, size)
        self._position = np.zeros((3, size, size), np.float32)
        # Around the origin, for the digits that a height of 1.5 m would cost.
        self._centre = np.array(scene.sheet.position, np.float32)
        self._position[0], self._position[1] = np.meshgrid(line, line)
        self._velocity = np.zeros_like(self._position)
        self._acceleration = np.zeros_like(self._position)
        self._moved = np.empty_like(self._position)
        self._springs = [
            _Springs(family, scene.sheet.particle_mass, self._position, self._acceleration)
            for family in spring_families(scene)
        ]

    def _drift(self, h: np.float32) -> None:
        np.multiply(self._velocity, h, out=self._moved)
        self._position += self._moved

    def _kick(self) -> None:
        acceleration = self._acceleration
        acceleration[:2] = 0
        acceleration[2] = self._gravity
        for springs in self._springs:
            springs.pull()
        acceleration[:, 0, 0] = 0
        acceleration[:, 0, -1] = 0
        acceleration *= self._h
        self._velocity += acceleration

    def advance(self) -> None:
        """Simulate 1/60 s."""
        half = np.float32(0.5) * self._h
        # Two half drifts between kicks are one.
        self._drift(half)
        for _ in range(self.substeps - 1):
            self._kick()
            self._drift(self._h)
        self._kick()
        self._drift(half)

    def positions(self) -> Any:
        """Return the positions, m, shape (size, size, 3)."""
        return np.moveaxis(self._position, 0, -1) + self._centre
