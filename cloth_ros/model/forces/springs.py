"""
Springs and dashpots between the particles of a sheet, after Provot (1995).

A spring of stiffness k and rest length L between particles p and q pulls p with

    F = k (L − |p − q|) (p − q) / |p − q|            (Hooke)
      − c ((u − w) · d) d,   d = (p − q) / |p − q|   (dashpot; u, w: velocities of p and q)

and is defined as zero where p = q.  `STENCIL` lists the three types of springs by the offset in
(rows, columns) from p to q; each spring also acts from q on p, in the opposite direction.

A spring stands for the strip of cloth along it, and a particle for a quarter of each cell around
it.  At the edge of the sheet, half of the strip is missing: structural and bending springs along
an edge have half the stiffness, and half the dashpot.  Diagonal springs lie within one cell.  In
units of the mass of a cell, a particle's mass is the product of its tributary lengths, a along its
row and b along its column, each 1, or 1/2 at an edge, so that

    dv/dt = g + (R/a + C/b + D/ab)/m,   m: mass of a cell,

with R, C and D the forces of the springs along the row, along the column and along the diagonals
at full stiffness.  The sheet then moves as a part of an unbounded one that is symmetric about its
edges, and converges to the continuous sheet with the second power of the spacing.  Only bending
springs reduce the order to one, where they resist stretching: in the first cell from an edge one
of them acts, where elsewhere two overlap.

X. Provot, "Deformation constraints in a mass-spring model to describe rigid cloth behaviour",
Graphics Interface 1995.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...scene import Scene
from ..grid import GHOST_DISTANCE_SQUARED, Array, tributary_lengths
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
COINCIDENT = 1e-30


@dataclass(frozen=True)
class SpringFamily:
    """All springs of one offset: `rows` and `columns` apart, `stiffness` N/m, `rest_length` m."""

    name: str
    rows: int
    columns: int
    stiffness: float
    rest_length: float

    def weights(self, rows: int, columns: int) -> Array:
        """
        Return the share of `stiffness` that each spring of a sheet has: 1, or 1/2 along an edge.

        Its shape, for a sheet of `rows` × `columns`, broadcasts to that of `spring_ends`.
        """
        if self.rows and self.columns:
            return np.ones((1, 1))
        return tributary_lengths(columns) if self.rows else tributary_lengths(rows)[:, None]


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
    mass = scene.sheet.cell_mass
    stiffness = [getattr(scene.springs, name) / mass for name in SPRING_TYPES]
    tension = [
        getattr(scene.springs, name) / mass * rest_length(scene, rows, columns)
        for name, rows, columns in STENCIL
    ]
    return (*scene.gravity, *stiffness, *tension, GHOST_DISTANCE_SQUARED, COINCIDENT)


@inlined
def stencil_offset(n, row):  # type: ignore[no-untyped-def]
    """Return the flat distance to the other end of spring `n` of the stencil; `row`: a row's."""
    return np.uint64(_ROWS[n]) * row + np.uint64(_COLUMNS[n])


@inlined
def _pull(position, velocity, i, j, k, tension, viscous, double, ghost, coincident):  # type: ignore[no-untyped-def]
    """Return the acceleration of particle i by its spring to j; if `viscous`, by the dashpot."""
    number = position.dtype.type
    dx = position[0, i] - position[0, j]
    dy = position[1, i] - position[1, j]
    dz = position[2, i] - position[2, j]
    # Added, and not the maximum of both: that costs no instruction, and changes no bit of the root
    # of a length that is not itself as short.
    squared = dx * dx + (dy * dy + (dz * dz + coincident))
    if double:
        # A reciprocal root in single precision, refined by Halley's method (its error is the third
        # power of the first one): three times faster than root and division in double precision.
        root = number(np.float32(1) / np.sqrt(np.float32(squared)))
        lack = number(1) - squared * root * root
        root += root * lack * (number(0.5) + number(0.375) * lack)
    else:
        root = number(1) / np.sqrt(squared)
    if viscous:
        du = velocity[0, i] - velocity[0, j]
        dv = velocity[1, i] - velocity[1, j]
        dw = velocity[2, i] - velocity[2, j]
        scale = -root * (root * (du * dx + dv * dy + dw * dz))
    else:
        scale = tension * root - k
    if squared > ghost:
        scale = k - k  # a zero of the same precision
    return scale * dx, scale * dy, scale * dz


@inlined
def _pair(position, velocity, i, offset, k, tension, viscous, double, ghost, coincident):  # type: ignore[no-untyped-def]
    """Return the acceleration of particle i by its two springs, or dashpots, of one offset."""
    x, y, z = _pull(
        position, velocity, i, i + offset, k, tension, viscous, double, ghost, coincident
    )
    p, q, r = _pull(
        position, velocity, i, i - offset, k, tension, viscous, double, ghost, coincident
    )
    return x + p, y + q, z + r


@inlined
def _add(a, b):  # type: ignore[no-untyped-def]
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def _acceleration(  # type: ignore[no-untyped-def]
    position, velocity, i, row, mobility, constants, structural, shear, bending, viscous, double,
):  # fmt: skip
    """Return the acceleration of particle i by all of its springs, or dashpots; 0 if pinned."""
    _, _, _, k0, k1, k2, t0, t1, t2, t3, t4, t5, ghost, tiny = constants
    zero = position.dtype.type(0)
    a, b = mobility[0, i], mobility[1, i]
    along = across = (zero, zero, zero)
    # Written out: a loop over the stencil would keep the loop over particles scalar.
    if structural:
        along = _pair(
            position, velocity, i, stencil_offset(0, row), k0, t0, viscous, double, ghost, tiny
        )
        across = _pair(
            position, velocity, i, stencil_offset(1, row), k0, t1, viscous, double, ghost, tiny
        )
    if bending:
        along = _add(
            along,
            _pair(
                position, velocity, i, stencil_offset(4, row), k2, t4, viscous, double, ghost, tiny
            ),
        )
        across = _add(
            across,
            _pair(
                position, velocity, i, stencil_offset(5, row), k2, t5, viscous, double, ghost, tiny
            ),
        )
    if shear:
        u, v, w = _add(
            _pair(
                position, velocity, i, stencil_offset(2, row), k1, t2, viscous, double, ghost, tiny
            ),
            _pair(
                position, velocity, i, stencil_offset(3, row), k1, t3, viscous, double, ghost, tiny
            ),
        )
        along = along[0] + b * u, along[1] + b * v, along[2] + b * w
    return (
        a * along[0] + b * across[0],
        a * along[1] + b * across[1],
        a * along[2] + b * across[2],
    )


@inlined
def spring_acceleration(  # type: ignore[no-untyped-def]
    position, i, row, mobility, constants, structural, shear, bending, double
):
    """Return the acceleration of particle i by gravity and by all of its springs; 0 if pinned."""
    x, y, z = constants[0], constants[1], constants[2]
    free = min(mobility[0, i], position.dtype.type(1))
    p, q, r = _acceleration(
        position, position, i, row, mobility, constants, structural, shear, bending, False, double
    )
    return free * x + p, free * y + q, free * z + r


@inlined
def dashpot_acceleration(  # type: ignore[no-untyped-def]
    position, velocity, i, row, mobility, constants, structural, shear, bending, double
):
    """Return the acceleration of particle i by its dashpots for c/m = 1; 0 if pinned."""
    return _acceleration(
        position, velocity, i, row, mobility, constants, structural, shear, bending, True, double
    )
