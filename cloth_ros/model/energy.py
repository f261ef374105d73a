"""Energy and strain of a state, in double precision."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .lattice import Array
from .scene import Scene
from .springs import ends, families


class Energy(NamedTuple):
    """Energy of a cloth by kind, J; gravitational energy is zero at the origin of the world."""

    kinetic: float
    elastic: float
    gravitational: float

    @property
    def total(self) -> float:
        """Sum of all kinds, J."""
        return self.kinetic + self.elastic + self.gravitational


def _lengths(grid: Array, scene: Scene) -> list[tuple[float, float, Array]]:
    """Return stiffness, rest length and present lengths of every family of springs."""
    result = []
    for family in families(scene):
        first, second = ends(family, grid)
        lengths = np.sqrt(np.sum((first - second) ** 2, axis=0))
        result.append((family.stiffness, family.rest_length, lengths))
    return result


def energy(positions: Array, velocities: Array, scene: Scene) -> Energy:
    """
    Return the energy of a state.

    Parameters
    ----------
    positions, velocities
        m and m/s, shape (3, rows, columns), double precision.
    scene
        Its masses, springs and gravity.

    """
    mass = scene.sheet.particle_mass
    gravity = np.array(scene.gravity)
    return Energy(
        kinetic=0.5 * mass * float(np.sum(velocities**2)),
        elastic=sum(
            0.5 * stiffness * float(np.sum((lengths - rest) ** 2))
            for stiffness, rest, lengths in _lengths(positions, scene)
        ),
        gravitational=-mass * float(gravity @ positions.sum(axis=(1, 2))),
    )


def largest_strain(positions: Array, scene: Scene) -> float:
    """Return the largest |length / rest length − 1| of any spring; 0 without springs."""
    return max(
        (
            float(np.max(np.abs(lengths / rest - 1)))
            for _, rest, lengths in _lengths(positions, scene)
        ),
        default=0.0,
    )
