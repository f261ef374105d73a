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

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...scene import Scene
from ..grid import GHOST_DISTANCE_SQUARED, Array
from ..kernels.jit import inlined

# Squared length, m², below which a spring has no direction; it only keeps the force finite.
_COINCIDENT = 1e-30


@dataclass(frozen=True)
class SpringFamily:
    """Springs of one offset: `rows` and `columns` apart, `stiffness` N/m, `rest_length` m."""

    name: str
    rows: int
    columns: int
    stiffness: float
    rest_length: float


def spring_families(scene: Scene) -> Iterator[SpringFamily]:
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
            yield SpringFamily(name, rows, columns, stiffness, rest_length)


def spring_ends(family: SpringFamily, grid: Array) -> tuple[Array, Array]:
    """Return views of both ends of every spring of a family in a grid (..., rows, columns)."""
    rows, columns = grid.shape[-2] - family.rows, grid.shape[-1] - abs(family.columns)
    left, right = max(-family.columns, 0), max(family.columns, 0)
    first = grid[..., :rows, left : left + columns]
    second = grid[..., family.rows :, right : right + columns]
    return first, second


@inlined
def _pull(position, velocity, i, j, k, kl, c, damped, double, ghost, tiny):  # type: ignore[no-untyped-def]
    """Return the acceleration of particle i by its spring to j."""
    number = position.dtype.type
    dx = position[0, i] - position[0, j]
    dy = position[1, i] - position[1, j]
    dz = position[2, i] - position[2, j]
    squared = dx * dx + dy * dy + dz * dz
    bounded = max(squared, tiny)
    if double:
        # Three times faster than root and division: a reciprocal root in single precision, and
        # what it lacks by Halley's method, whose error is the third power of that.
        root = number(np.float32(1) / np.sqrt(np.float32(bounded)))
        lack = number(1) - bounded * root * root
        root += root * lack * (number(0.5) + number(0.375) * lack)
    else:
        root = number(1) / np.sqrt(bounded)
    if damped:
        du = velocity[0, i] - velocity[0, j]
        dv = velocity[1, i] - velocity[1, j]
        dw = velocity[2, i] - velocity[2, j]
        kl = kl - c * root * (du * dx + dv * dy + dw * dz)
    scale = kl * root - k
    if squared > ghost:
        scale = k - k  # a zero of the same precision
    return scale * dx, scale * dy, scale * dz


@inlined
def _pull_both(position, velocity, i, offset, k, kl, c, damped, double, ghost, tiny):  # type: ignore[no-untyped-def]
    a, b, d = _pull(position, velocity, i, i + offset, k, kl, c, damped, double, ghost, tiny)
    e, f, g = _pull(position, velocity, i, i - offset, k, kl, c, damped, double, ghost, tiny)
    return a + e, b + f, d + g


@inlined
def spring_acceleration(  # type: ignore[no-untyped-def]
    position, velocity, i, row, numbers, c, structural, shear, bending, damped, double
):
    """Return the acceleration of particle i by gravity and by all of its springs."""
    one = np.uint64(1)
    x, y, z, k0, k1, k2, kl0, kl1, kl2, kl3, kl4, ghost, tiny = numbers
    if structural:
        a, b, d = _pull_both(position, velocity, i, one, k0, kl0, c, damped, double, ghost, tiny)
        x, y, z = x + a, y + b, z + d
        a, b, d = _pull_both(position, velocity, i, row, k0, kl1, c, damped, double, ghost, tiny)
        x, y, z = x + a, y + b, z + d
    if shear:
        a, b, d = _pull_both(
            position, velocity, i, row + one, k1, kl2, c, damped, double, ghost, tiny
        )
        x, y, z = x + a, y + b, z + d
        a, b, d = _pull_both(
            position, velocity, i, row - one, k1, kl2, c, damped, double, ghost, tiny
        )
        x, y, z = x + a, y + b, z + d
    if bending:
        a, b, d = _pull_both(
            position, velocity, i, one + one, k2, kl3, c, damped, double, ghost, tiny
        )
        x, y, z = x + a, y + b, z + d
        a, b, d = _pull_both(
            position, velocity, i, row + row, k2, kl4, c, damped, double, ghost, tiny
        )
        x, y, z = x + a, y + b, z + d
    return x, y, z


def constants(scene: Scene) -> tuple[float, ...]:
    """Return what `pull_all` takes: gravity, stiffness and tension per mass, and bounds."""
    springs, mass = scene.springs, scene.sheet.particle_mass
    dx, dy = scene.sheet.spacing
    k = np.array([springs.structural, springs.shear, springs.bending]) / mass
    rest = np.array([dx, dy, math.hypot(dx, dy), 2 * dx, 2 * dy])
    bounds = (GHOST_DISTANCE_SQUARED, _COINCIDENT)
    return (*scene.gravity, *k, *(k[[0, 0, 1, 2, 2]] * rest), *bounds)
