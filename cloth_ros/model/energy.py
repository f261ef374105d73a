"""Energy of a state."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from ..scene import Scene
from .forces.springs import (
    SPRING_TYPES,
    STENCIL,
    SpringFamily,
    rest_length,
    spring_ends,
    spring_families,
    stencil_offset,
)
from .grid import GHOST_DISTANCE_SQUARED, Array, Grid, tributary_lengths
from .kernels.jit import Kernel, inlined, kernel
from .state import State


class Energy(NamedTuple):
    """Energy of a cloth by kind, J; gravitational energy is zero at the origin of the world."""

    kinetic: float
    elastic: float
    gravitational: float

    @property
    def total(self) -> float:
        """Sum of all kinds, J."""
        return self.kinetic + self.elastic + self.gravitational

    @property
    def motion(self) -> float:
        """Kinetic and elastic energy, J, which convert into one another in a swing."""
        return self.kinetic + self.elastic


def _elastic(family: SpringFamily, positions: Array) -> float:
    """Return the elastic energy of a family of springs, J."""
    first, second = spring_ends(family, positions)
    elongations = np.sqrt(np.sum((first - second) ** 2, axis=0)) - family.rest_length
    weights = family.weights(*positions.shape[1:])
    return 0.5 * family.stiffness * float(np.sum(weights * elongations**2))


def energy(positions: Array, velocities: Array, scene: Scene) -> Energy:
    """
    Return the energy of a state, in double precision.

    Parameters
    ----------
    positions, velocities
        m and m/s, shape (3, rows, columns), double precision.
    scene
        Its masses, springs and gravity.

    """
    rows, columns = positions.shape[1:]
    masses = scene.sheet.cell_mass * Grid(rows, columns).tributary_areas
    gravity = np.array(scene.gravity)
    return Energy(
        kinetic=0.5 * float(np.sum(masses * velocities**2)),
        elastic=sum(_elastic(family, positions) for family in spring_families(scene)),
        gravitational=-float(gravity @ (masses * positions).sum(axis=(1, 2))),
    )


@inlined
def _elongation_squared(position, i, j, rest, ghost):  # type: ignore[no-untyped-def]
    """Return (length − rest length)² of the spring from i to j, m²; 0 if one is a ghost."""
    x = position[0, j] - position[0, i]
    y = position[1, j] - position[1, i]
    z = position[2, j] - position[2, i]
    squared = x * x + y * y + z * z
    elongation = np.sqrt(squared) - rest
    if squared > ghost:
        elongation = rest - rest
    return elongation * elongation


@inlined
def _of_type(position, i, row, n, along, across, rest, ghost):  # type: ignore[no-untyped-def]
    """Return the weighted sum of squared elongations of springs 2 n and 2 n + 1 of the stencil."""
    first, second = i + stencil_offset(2 * n, row), i + stencil_offset(2 * n + 1, row)
    return along * _elongation_squared(
        position, i, first, rest[2 * n], ghost
    ) + across * _elongation_squared(position, i, second, rest[2 * n + 1], ghost)


@functools.cache
def _compose(structural: bool, shear: bool, bending: bool) -> Kernel:
    """Compile the kernel for the types of springs that a scene has."""

    @kernel
    def sums(position, velocity, begin, stride, down, beside, k, rest, ghost, out):  # type: ignore[no-untyped-def]
        # Each row in the precision of the state, the sum of rows in double precision.
        row = np.uint64(stride)
        one = beside.dtype.type(1)
        for n in range(len(down)):
            first = np.uint64(begin + n * stride)
            b = down[n]
            squares = elastic = x = y = z = ghost - ghost
            for column in range(np.uint64(len(beside))):
                i, a = first + column, beside[column]
                u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
                squares += a * (u * u + v * v + w * w)
                x += a * position[0, i]
                y += a * position[1, i]
                z += a * position[2, i]
                if structural:
                    elastic += k[0] * _of_type(position, i, row, 0, b, a, rest, ghost)
                if shear:
                    elastic += k[1] * _of_type(position, i, row, 1, one, one, rest, ghost)
                if bending:
                    elastic += k[2] * _of_type(position, i, row, 2, b, a, rest, ghost)
            out[0] += b * squares
            out[1] += elastic
            out[2] += b * x
            out[3] += b * y
            out[4] += b * z

    return sums


class EnergyMeter:
    """
    Measure the energy of a state in about the time of a substep, to the state's precision.

    Parameters
    ----------
    scene
        Its masses, springs and gravity.
    dtype
        Precision of the states.

    """

    def __init__(self, scene: Scene, dtype: type) -> None:
        springs, sheet = scene.springs, scene.sheet
        present = {family.name for family in spring_families(scene)}
        self._mass, self._gravity = sheet.cell_mass, np.array(scene.gravity)
        self._cells = sheet.mass / sheet.cell_mass
        self._tributary_lengths: list[Array] = [
            tributary_lengths(count).astype(dtype) for count in (sheet.rows, sheet.columns)
        ]
        self._kernel = _compose(*(name in present for name in SPRING_TYPES))
        self._stiffness = tuple(dtype(getattr(springs, name)) for name in SPRING_TYPES)
        self._rest = tuple(
            dtype(rest_length(scene, rows, columns)) for _, rows, columns in STENCIL
        )
        self._ghost = dtype(GHOST_DISTANCE_SQUARED)

    def measure(self, state: State) -> Energy:
        """Return the energy of a state."""
        grid, sums = state.grid, np.zeros(5)
        self._kernel(
            state.position,
            state.velocity,
            grid.begin,
            grid.stride,
            *self._tributary_lengths,
            self._stiffness,
            self._rest,
            self._ghost,
            sums,
        )
        place = sums[2:] + self._cells * state.origin
        return Energy(
            kinetic=0.5 * self._mass * float(sums[0]),
            elastic=0.5 * float(sums[1]),
            gravitational=-self._mass * float(self._gravity @ place),
        )
