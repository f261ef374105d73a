"""The state of a cloth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .grid import GHOST, Array, Grid
from .kernels.jit import kernel

# Particles whose speeds are compared at once.
_LANES = 64


@dataclass
class State:
    """
    Flat arrays of a sheet, laid out as `Lattice` says.

    Attributes
    ----------
    origin
        Of the positions below, in the world, m, shape (3,): the centre of the undeformed sheet,
        or near a sheet that has strayed from there.  Single precision then resolves the cloth and
        not its distance from the origin of the world.
    position
        m, from `origin`, shape (3, size).
    other
        Where kernels write positions that they move, and then exchange both.
    velocity, acceleration
        m/s and m/s², shape (3, size); zero for pinned particles and ghosts.
    free
        1 for particles that move, 0 for pinned ones and ghosts, shape (size,).

    """

    lattice: Grid
    dtype: Any
    origin: Array = field(default_factory=lambda: np.zeros(3))
    position: Array = field(init=False)
    other: Array = field(init=False)
    velocity: Array = field(init=False)
    acceleration: Array = field(init=False)
    free: Array = field(init=False)

    def __post_init__(self) -> None:
        """Allocate the arrays, with every particle free at the centre and at rest."""
        self.position = self.lattice.field(self.dtype, GHOST)
        self.lattice.grid(self.position)[...] = 0
        self.other = self.position.copy()
        self.velocity = self.lattice.field(self.dtype)
        self.acceleration = self.lattice.field(self.dtype)
        self.free = self.lattice.field(self.dtype, components=1)[0]
        self.lattice.grid(self.free)[...] = 1

    @property
    def world(self) -> Array:
        """
        Positions in the world, m, double precision, shape (3, rows, columns); set all.

        The origin is moved to a sheet that is set farther from it than it is wide.
        """
        positions: Array = self.lattice.grid(self.position) + self.origin[:, None, None]
        return positions

    @world.setter
    def world(self, positions: Array) -> None:
        low, high = positions.min(axis=(1, 2)), positions.max(axis=(1, 2))
        middle = 0.5 * (low + high)
        # Not where it need not move: what is set to what it is must not be rounded.
        if np.abs(middle - self.origin).max() > (high - low).max():
            self.origin = middle
        self.lattice.grid(self.position)[...] = positions - self.origin[:, None, None]

    @property
    def speeds(self) -> Array:
        """Velocities, m/s, double precision, shape (3, rows, columns)."""
        return self.lattice.grid(self.velocity).astype(float)

    def copy_from(self, other: State) -> None:
        """Take over positions and velocities of another state of this lattice."""
        grid = self.lattice.grid
        self.origin = other.origin
        grid(self.position)[...] = grid(other.position)
        grid(self.velocity)[...] = grid(other.velocity)

    def follow(self, reach: float) -> None:
        """Move the origin along with a sheet that has strayed from it by more than `reach`, m."""
        strayed = self.position[:, self.lattice.begin].astype(float)
        if reach < np.abs(strayed).max() < np.inf:
            # Multiples of a power of two: their differences are not rounded.
            unit = 2.0 ** math.floor(math.log2(reach))
            shift = unit * np.round(strayed / unit)
            self.lattice.grid(self.position)[...] -= shift[:, None, None].astype(self.dtype)
            self.origin = self.origin + shift

    def pin(self, pinned: Array) -> None:
        """Hold the particles where `pinned`, bool, shape (rows, columns), and free the others."""
        self.lattice.grid(self.free)[...] = ~pinned
        self.velocity *= self.free
        self.acceleration *= self.free


@kernel
def _max_squared_speed(velocity, size):  # type: ignore[no-untyped-def]
    # Lane by lane: LLVM leaves the maximum of a whole array scalar, NaN being what it is.
    greatest = np.zeros(_LANES, velocity.dtype)
    whole = size // _LANES * _LANES
    for first in range(np.uint64(0), np.uint64(whole), np.uint64(_LANES)):
        for lane in range(np.uint64(_LANES)):
            i = first + lane
            u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
            greatest[lane] = max(greatest[lane], u * u + v * v + w * w)
    for i in range(np.uint64(whole), np.uint64(size)):
        u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
        greatest[0] = max(greatest[0], u * u + v * v + w * w)
    return greatest.max()


def max_speed(state: State) -> float:
    """Return the speed of the fastest particle, m/s."""
    return math.sqrt(_max_squared_speed(state.velocity, state.lattice.size))
