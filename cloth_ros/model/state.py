"""Positions and velocities of the particles of a sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .grid import GHOST, Array, Grid, tributary_lengths
from .kernels.jit import kernel

# Particles whose speeds are compared in one iteration.
_LANES = 64


@dataclass
class State:
    """
    Flat arrays of a sheet, in the layout of `Grid`.

    Attributes
    ----------
    origin
        Origin of the positions below, in the world, m, shape (3,): the centre of the undeformed
        sheet, or a point near a sheet that has moved far from there.  Single precision then
        resolves the cloth and not its distance from the origin of the world.
    position
        m, from `origin`, shape (3, size).
    back_buffer
        Receives the positions of a drift; then swapped with `position`.
    velocity, acceleration
        m/s and m/s², shape (3, size); zero for pinned particles and ghosts.
    free
        1 for particles that move, 0 for pinned ones and ghosts, shape (size,).
    mobility
        The reciprocals of a particle's tributary lengths along its row and along its column, in
        units of the spacing: 2 at an end, otherwise 1, and 0 for pinned particles and ghosts;
        shape (2, size).  Their product is the reciprocal of its mass, in units of that of a cell.
    contact_mobility
        The same for contact, which does not move particles that grippers hold either: 0 for these.
    held
        Flat indices of these, ascending, shape (n,); another array whenever they change.

    """

    grid: Grid
    dtype: Any
    origin: Array = field(default_factory=lambda: np.zeros(3))
    position: Array = field(init=False)
    back_buffer: Array = field(init=False)
    velocity: Array = field(init=False)
    acceleration: Array = field(init=False)
    free: Array = field(init=False)
    mobility: Array = field(init=False)
    contact_mobility: Array = field(init=False)
    held: Array = field(init=False)

    def __post_init__(self) -> None:
        """Allocate the arrays, with every particle free, at the origin and at rest."""
        self.position = self.grid.field(self.dtype, GHOST)
        self.grid.interior(self.position)[...] = 0
        self.back_buffer = self.position.copy()
        self.velocity = self.grid.field(self.dtype)
        self.acceleration = self.grid.field(self.dtype)
        self.free = self.grid.field(self.dtype, components=1)[0]
        self.mobility = self.grid.field(self.dtype, components=2)
        self.pin(np.zeros((self.grid.rows, self.grid.columns), bool))

    @property
    def world_positions(self) -> Array:
        """
        Positions in the world, m, double precision, shape (3, rows, columns); assignable.

        Assignment moves the origin to a sheet that is farther from it than it is wide.
        """
        positions: Array = self.grid.interior(self.position) + self.origin[:, None, None]
        return positions

    @world_positions.setter
    def world_positions(self, positions: Array) -> None:
        low, high = positions.min(axis=(1, 2)), positions.max(axis=(1, 2))
        middle = 0.5 * (low + high)
        # Only where it must move: assigning what is read must not round anything.
        if np.abs(middle - self.origin).max() > (high - low).max():
            self.origin = middle
        self.grid.interior(self.position)[...] = positions - self.origin[:, None, None]

    @property
    def velocities(self) -> Array:
        """Velocities, m/s, double precision, shape (3, rows, columns); assignable."""
        return self.grid.interior(self.velocity).astype(float)

    @velocities.setter
    def velocities(self, velocities: Array) -> None:
        self.grid.interior(self.velocity)[...] = velocities
        self.velocity *= self.free

    def recenter_origin(self, reach: float) -> None:
        """Move the origin to a sheet that is farther from it than `reach`, m."""
        offset = self.position[:, self.grid.begin].astype(float)
        if reach < np.abs(offset).max() < np.inf:
            # Multiples of a power of two: their differences are exact.
            unit = 2.0 ** math.floor(math.log2(reach))
            shift = unit * np.round(offset / unit)
            self.grid.interior(self.position)[...] -= shift[:, None, None].astype(self.dtype)
            self.origin = self.origin + shift

    def pin(self, pinned: Array) -> None:
        """Hold the particles where `pinned`, bool, shape (rows, columns), and free the others."""
        self.grid.interior(self.free)[...] = ~pinned
        along, across = self.grid.interior(self.mobility)
        along[...] = ~pinned / tributary_lengths(self.grid.columns)
        across[...] = ~pinned / tributary_lengths(self.grid.rows)[:, None]
        self.velocity *= self.free
        self.acceleration *= self.free
        self.hold(np.zeros(0, np.int64))

    def hold(self, held: Array) -> None:
        """Note which particles grippers hold, by their flat indices."""
        self.held, self.contact_mobility = held, self.mobility
        if len(held):
            self.contact_mobility = self.mobility.copy()
            self.contact_mobility[:, held] = 0


@kernel
def _max_squared_speed(velocity, size):  # type: ignore[no-untyped-def]
    # Lane by lane: LLVM does not vectorise the maximum of an array that may hold NaN.
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
    for lane in range(np.uint64(1), np.uint64(_LANES)):
        greatest[0] = max(greatest[0], greatest[lane])
    return greatest[0]


def max_speed(state: State) -> float:
    """Return the speed of the fastest particle, m/s; NaN if one is not finite."""
    return math.sqrt(_max_squared_speed(state.velocity, state.grid.size))
