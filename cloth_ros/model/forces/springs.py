"""
Springs and dashpots between the particles of a sheet, after Provot (1995).

A spring of stiffness k and rest length L between particles p and q pulls p with

    F = k (L − |p − q|) (p − q) / |p − q|            (Hooke)
      − c ((u − w) · d) d,   d = (p − q) / |p − q|   (dashpot; u, w: velocities of p and q)

and is defined as zero where p = q.  `STENCIL` lists the three types of springs by the offset in
(rows, columns) from p to q; each spring also acts from q on p, in the opposite direction.

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

# Type of spring, and offset in rows and columns.  All code that goes over springs uses this table.
STENCIL = (
    ('structural', 0, 1),
    ('structural', 1, 0),
    ('shear', 1, 1),
    ('shear', 1, -1),
    ('bending', 0, 2),
    ('bending', 2, 0),
)
SPRING_TYPES = tuple(dict.fromkeys(name for name, _, _ in STENCIL))
_ROWS, _COLUMNS = (tuple(offset[axis] for offset in STENCIL) for axis in (1, 2))
# Squared length, m², below which a spring has no direction; it only keeps the force finite.
_COINCIDENT = 1e-30


@dataclass(frozen=True)
class SpringFamily:
    """All springs of one offset: `rows` and `columns` apart, `stiffness` N/m, `rest_length` m."""

    name: str
    rows: int
    columns: int
    stiffness: float
    rest_length: float


def rest_length(scene: Scene, rows: int, columns: int) -> float:
    """Return the length, m, of a spring of an offset in the undeformed sheet."""
    dx, dy = scene.sheet.spacing
    return math.hypot(columns * dx, rows * dy)


def spring_families(scene: Scene) -> Iterator[SpringFamily]:
    """Yield the springs of a scene by offset, each spring once, absent ones left out."""
    for name, rows, columns in STENCIL:
        stiffness = getattr(scene.springs, name)
        if stiffness > 0 and rows < scene.sheet.rows and abs(columns) < scene.sheet.columns:
            yield SpringFamily(name, rows, columns, stiffness, rest_length(scene, rows, columns))


def spring_ends(family: SpringFamily, field: Array) -> tuple[Array, Array]:
    """Return views of both ends of every spring of a family in a field (..., rows, columns)."""
    return offset_views(field, family.rows, family.columns)


def offset_views(field: Array, rows: int, columns: int) -> tuple[Array, Array]:
    """Return views of a field (..., rows, columns) and of itself at an offset, where both are."""
    height, width = field.shape[-2] - rows, field.shape[-1] - abs(columns)
    left, right = max(-columns, 0), max(columns, 0)
    first = field[..., :height, left : left + width]
    second = field[..., rows:, right : right + width]
    return first, second


def spring_constants(scene: Scene) -> tuple[float, ...]:
    """
    Return what `spring_acceleration` takes.

    Returns
    -------
    tuple of 14 floats
        Gravity, m/s² (3); k/m of each type, 1/s² (3); k L/m of each offset of the stencil, m/s²
        (6); squared lengths, m², beyond which the other end is a ghost, and below which a spring
        has no direction.

    """
    mass = scene.sheet.particle_mass
    stiffness = [getattr(scene.springs, name) / mass for name in SPRING_TYPES]
    tension = [
        getattr(scene.springs, name) / mass * rest_length(scene, rows, columns)
        for name, rows, columns in STENCIL
    ]
    return (*scene.gravity, *stiffness, *tension, GHOST_DISTANCE_SQUARED, _COINCIDENT)


@inlined
def stencil_offset(n, row):  # type: ignore[no-untyped-def]
    """Return the flat distance to the other end of spring `n` of the stencil; `row`: a row's."""
    return np.uint64(_ROWS[n]) * row + np.uint64(_COLUMNS[n])


@inlined
def _pull(position, velocity, i, j, k, tension, dashpot, damped, double, ghost, coincident):  # type: ignore[no-untyped-def]
    """Return the acceleration of particle i by its spring to j."""
    number = position.dtype.type
    dx = position[0, i] - position[0, j]
    dy = position[1, i] - position[1, j]
    dz = position[2, i] - position[2, j]
    squared = dx * dx + dy * dy + dz * dz
    bounded = max(squared, coincident)
    if double:
        # A reciprocal root in single precision, refined by Halley's method (its error is the third
        # power of the first one): three times faster than root and division in double precision.
        root = number(np.float32(1) / np.sqrt(np.float32(bounded)))
        lack = number(1) - bounded * root * root
        root += root * lack * (number(0.5) + number(0.375) * lack)
    else:
        root = number(1) / np.sqrt(bounded)
    if damped:
        du = velocity[0, i] - velocity[0, j]
        dv = velocity[1, i] - velocity[1, j]
        dw = velocity[2, i] - velocity[2, j]
        tension = tension - dashpot * root * (du * dx + dv * dy + dw * dz)
    scale = tension * root - k
    if squared > ghost:
        scale = k - k  # a zero of the same precision
    return scale * dx, scale * dy, scale * dz


@inlined
def _add_pair(  # type: ignore[no-untyped-def]
    total, position, velocity, i, offset, k, tension, dashpot, damped, double, ghost, coincident
):
    """Add the acceleration of particle i by its two springs of one offset."""
    x, y, z = total
    a, b, c = _pull(
        position, velocity, i, i + offset, k, tension, dashpot, damped, double, ghost, coincident
    )
    p, q, r = _pull(
        position, velocity, i, i - offset, k, tension, dashpot, damped, double, ghost, coincident
    )
    return x + (a + p), y + (b + q), z + (c + r)


@inlined
def spring_acceleration(  # type: ignore[no-untyped-def]
    position, velocity, i, row, constants, dashpot, structural, shear, bending, damped, double
):
    """Return the acceleration of particle i by gravity and by all of its springs."""
    x, y, z, k0, k1, k2, t0, t1, t2, t3, t4, t5, ghost, tiny = constants
    a = x, y, z
    # Written out: a loop over the stencil would keep the loop over particles scalar.
    if structural:
        a = _add_pair(
            a,
            position,
            velocity,
            i,
            stencil_offset(0, row),
            k0,
            t0,
            dashpot,
            damped,
            double,
            ghost,
            tiny,
        )
        a = _add_pair(
            a,
            position,
            velocity,
            i,
            stencil_offset(1, row),
            k0,
            t1,
            dashpot,
            damped,
            double,
            ghost,
            tiny,
        )
    if shear:
        a = _add_pair(
            a,
            position,
            velocity,
            i,
            stencil_offset(2, row),
            k1,
            t2,
            dashpot,
            damped,
            double,
            ghost,
            tiny,
        )
        a = _add_pair(
            a,
            position,
            velocity,
            i,
            stencil_offset(3, row),
            k1,
            t3,
            dashpot,
            damped,
            double,
            ghost,
            tiny,
        )
    if bending:
        a = _add_pair(
            a,
            position,
            velocity,
            i,
            stencil_offset(4, row),
            k2,
            t4,
            dashpot,
            damped,
            double,
            ghost,
            tiny,
        )
        a = _add_pair(
            a,
            position,
            velocity,
            i,
            stencil_offset(5, row),
            k2,
            t5,
            dashpot,
            damped,
            double,
            ghost,
            tiny,
        )
    return a
