"""
Springs and dashpots between the particles of a sheet, after Provot (1995).

A spring of stiffness k and rest length L between particles p and q pulls p with

    F = k (L − |p − q|) (p − q) / |p − q|            (Hooke)
      − c ((u − w) · d) d,   d = (p − q) / |p − q|   (dashpot; u, w: velocities of p and q)

and is defined as zero where p = q.  Three families, by the offset in (rows, columns) from p to q:
structural (0, ±1) and (±1, 0), shear (±1, ±1), bending (0, ±2) and (±2, 0).

X. Provot, "Deformation constraints in a mass-spring model to describe rigid cloth behaviour",
Graphics Interface 1995.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .compile import inlined, kernel
from .lattice import GHOST_DISTANCE_SQUARED, Array, Lattice
from .scene import Scene

# Squared length, m², below which a spring has no direction; it only keeps the force finite.
_COINCIDENT = 1e-30


@dataclass(frozen=True)
class Family:
    """Springs of one offset: `rows` and `columns` apart, `stiffness` N/m, `rest_length` m."""

    name: str
    rows: int
    columns: int
    stiffness: float
    rest_length: float


def families(scene: Scene) -> Iterator[Family]:
    """Yield the springs of a scene by offset, each spring once, absent ones left out."""
    dx, dy = scene.sheet.spacing
    diagonal = math.hypot(dx, dy)
    springs = scene.springs
    for name, rows, columns, stiffness, rest_length in (
        ('structural', 0, 1, springs.structural, dx),
        ('structural', 1, 0, springs.structural, dy),
        ('shear', 1, 1, springs.shear, diagonal),
        ('shear', 1, -1, springs.shear, diagonal),
        ('bending', 0, 2, springs.bending, 2 * dx),
        ('bending', 2, 0, springs.bending, 2 * dy),
    ):
        if stiffness > 0 and rows < scene.sheet.rows and abs(columns) < scene.sheet.columns:
            yield Family(name, rows, columns, stiffness, rest_length)


def ends(family: Family, grid: Array) -> tuple[Array, Array]:
    """Return views of both ends of every spring of a family in a grid (..., rows, columns)."""
    rows, columns = grid.shape[-2] - family.rows, grid.shape[-1] - abs(family.columns)
    left, right = max(-family.columns, 0), max(family.columns, 0)
    first = grid[..., :rows, left : left + columns]
    second = grid[..., family.rows :, right : right + columns]
    return first, second


@inlined
def _pull(position, velocity, p, q, k, kl, c, damped, ghost, tiny):  # type: ignore[no-untyped-def]
    dx = position[0, p] - position[0, q]
    dy = position[1, p] - position[1, q]
    dz = position[2, p] - position[2, q]
    squared = dx * dx + dy * dy + dz * dz
    root = np.sqrt(max(squared, tiny))
    if damped:
        du = velocity[0, p] - velocity[0, q]
        dv = velocity[1, p] - velocity[1, q]
        dw = velocity[2, p] - velocity[2, q]
        kl = kl - c * (du * dx + dv * dy + dw * dz) / root
    scale = kl / root - k
    if squared > ghost:
        scale = k - k  # a zero of the same precision
    return scale * dx, scale * dy, scale * dz


@inlined
def _pull_both(position, velocity, i, offset, k, kl, c, damped, ghost, tiny):  # type: ignore[no-untyped-def]
    a, b, d = _pull(position, velocity, i, i + offset, k, kl, c, damped, ghost, tiny)
    e, f, g = _pull(position, velocity, i, i - offset, k, kl, c, damped, ghost, tiny)
    return a + e, b + f, d + g


@functools.cache
def _compose(structural: bool, shear: bool, bending: bool, damped: bool) -> Callable[..., None]:
    """Compose the kernel of a scene: what the scene lacks is not in the compiled code."""

    @kernel
    def accelerate(  # type: ignore[no-untyped-def]
        position, velocity, free, out, begin, end, stride, gravity, k, kl, c, ghost, tiny
    ):
        one = np.uint64(1)
        row = np.uint64(stride)
        gx, gy, gz = gravity[0], gravity[1], gravity[2]
        k0, k1, k2 = k[0], k[1], k[2]
        kl0, kl1, kl2, kl3, kl4 = kl[0], kl[1], kl[2], kl[3], kl[4]
        for i in range(np.uint64(begin), np.uint64(end)):
            x, y, z = gx, gy, gz
            if structural:
                a, b, d = _pull_both(position, velocity, i, one, k0, kl0, c, damped, ghost, tiny)
                x, y, z = x + a, y + b, z + d
                a, b, d = _pull_both(position, velocity, i, row, k0, kl1, c, damped, ghost, tiny)
                x, y, z = x + a, y + b, z + d
            if shear:
                a, b, d = _pull_both(
                    position, velocity, i, row + one, k1, kl2, c, damped, ghost, tiny
                )
                x, y, z = x + a, y + b, z + d
                a, b, d = _pull_both(
                    position, velocity, i, row - one, k1, kl2, c, damped, ghost, tiny
                )
                x, y, z = x + a, y + b, z + d
            if bending:
                a, b, d = _pull_both(
                    position, velocity, i, one + one, k2, kl3, c, damped, ghost, tiny
                )
                x, y, z = x + a, y + b, z + d
                a, b, d = _pull_both(
                    position, velocity, i, row + row, k2, kl4, c, damped, ghost, tiny
                )
                x, y, z = x + a, y + b, z + d
            out[0, i] = free[i] * x
            out[1, i] = free[i] * y
            out[2, i] = free[i] * z

    return accelerate


class Springs:
    """
    Acceleration of the particles by springs, dashpots and gravity.

    Gravity is a constant that the loop over the springs starts from, and so costs nothing.

    Attributes
    ----------
    damped
        True if there are dashpots along the springs.

    """

    def __init__(self, scene: Scene, lattice: Lattice, dtype: Any) -> None:
        present = {family.name for family in families(scene)}
        damping = scene.springs.damping if present else 0.0
        self.damped = damping > 0
        self._kernel = _compose(
            'structural' in present, 'shear' in present, 'bending' in present, self.damped
        )
        mass = scene.sheet.particle_mass
        dx, dy = scene.sheet.spacing
        k = np.array([scene.springs.structural, scene.springs.shear, scene.springs.bending]) / mass
        rest = np.array([dx, dy, math.hypot(dx, dy), 2 * dx, 2 * dy])
        number = np.dtype(dtype).type
        self._arguments = (
            lattice.begin,
            lattice.end,
            lattice.stride,
            np.array(scene.gravity, dtype),
            k.astype(dtype),
            (k[[0, 0, 1, 2, 2]] * rest).astype(dtype),
            number(damping / mass),
            number(GHOST_DISTANCE_SQUARED),
            number(_COINCIDENT),
        )

    def accelerate(self, position: Array, velocity: Array, free: Array, out: Array) -> None:
        """
        Write the acceleration of every particle.

        Parameters
        ----------
        position, velocity
            Flat arrays, m and m/s, shape (3, size).
        free
            1 for particles that move, 0 for pinned ones and ghosts, shape (size,).
        out
            Acceleration, m/s², shape (3, size); ghosts between the rows get 0.

        """
        self._kernel(position, velocity, free, out, *self._arguments)
