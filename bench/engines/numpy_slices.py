"""
Position Verlet in NumPy, written for speed: array slices, no loops, no temporary arrays.

Single precision, with substeps that are stable in every state.  Each of the six families of
springs is one sequence of operations on whole slices, with `out=` arrays that are allocated once:
a substep takes 0.56 to 0.65 of the time that it takes with the forces of
`cloth_ros.tradeoff.reference_model`, at 16² to 128² particles.
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
    """Springs of one offset: views of their ends, and arrays for intermediate results."""

    def __init__(self, family: Any, mass: float, position: Any, force: Any) -> None:
        from cloth_ros.model.forces.springs import spring_ends

        self._near, self._far = spring_ends(family, position)
        self._force_near, self._force_far = spring_ends(family, force)
        stiffness = family.stiffness / mass * family.weights(*position.shape[1:])
        self._stiffness = stiffness.astype(np.float32)
        self._tension = (stiffness * family.rest_length).astype(np.float32)
        self._along = np.empty(self._near.shape, np.float32)
        self._square = np.empty_like(self._along)
        self._scale = np.empty(self._near.shape[1:], np.float32)

    def add_forces(self) -> None:
        """Add the force per mass of a cell, d (k L / |d| − k), to one end, and its reaction."""
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
        from cloth_ros.model.grid import Grid
        from cloth_ros.model.time_step import substep_length

        scene = sheets.scene(size)
        self.substeps = round(_TICK / substep_length(scene))
        self.settings = f'position Verlet, float32, {self.substeps} substeps a tick'
        self._h = np.float32(_TICK / self.substeps)
        self._gravity = np.float32(scene.gravity[2])
        self._inverse_masses = (1 / Grid(size, size).tributary_areas).astype(np.float32)

        line = np.linspace(-0.5, 0.5, size)
        self._position = np.zeros((3, size, size), np.float32)
        # Relative to the centre: at a height of 1.5 m single precision has fewer digits left.
        self._centre = np.array(scene.sheet.position, np.float32)
        self._position[0], self._position[1] = np.meshgrid(line, line)
        self._velocity = np.zeros_like(self._position)
        self._acceleration = np.zeros_like(self._position)
        self._drifted = np.empty_like(self._position)
        self._springs = [
            _Springs(family, scene.sheet.cell_mass, self._position, self._acceleration)
            for family in spring_families(scene)
        ]

    def _drift(self, h: np.float32) -> None:
        np.multiply(self._velocity, h, out=self._drifted)
        self._position += self._drifted

    def _kick(self) -> None:
        acceleration = self._acceleration
        acceleration[...] = 0
        for springs in self._springs:
            springs.add_forces()
        acceleration *= self._inverse_masses
        acceleration[2] += self._gravity
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
