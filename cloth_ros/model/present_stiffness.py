"""
Bound of the stiffness of the present state of a sheet, for a step that `stability` cannot promise.

With the displacements u of the particles, the springs of a sheet hold ½ uᵀK u, and no more than
they would if both ends moved in opposite directions: uᵀK u ≤ 2 Σᵢ uᵢᵀ Sᵢ uᵢ.  Sᵢ is the sum over
the springs at particle i of their own stiffness

    k (L/r d dᵀ + (1 − L/r) I)   where stretched, r > L;   k d dᵀ   where not,

d the direction of a spring (what is left out there is negative, and lowers the stiffness).  Twice
the greatest eigenvalue of all Sᵢ/mᵢ therefore bounds that of the stiffness per unit mass.  It is
bounded in turn by the row sums of the Gram matrix of directions, so that for a group of springs

    λ ≤ 2 maxᵢ (Σⱼ kⱼ (1 − wⱼ) + maxⱼ Σₗ kₗ wₗ |dⱼ·dₗ|)/mᵢ,   w = min(1, L/r).

A spring to a pinned particle counts half, because one end alone moves.  The bounds of structural,
shear and bending springs are added.  For a flat sheet with square cells the result is within 3 %
of the exact value of an unbounded sheet; it is lower than the bound for every state (`stability`)
where springs at a particle are not parallel.  The particles at the corners are left out: their
mass is a quarter, for which the bound is not sharp, and a flat sheet is no stiffer with corners
than without.
"""

from __future__ import annotations

import numpy as np

from ..scene import Scene
from .forces.springs import (
    COINCIDENT,
    SPRING_TYPES,
    STENCIL,
    rest_length,
    stencil_offset,
)
from .grid import GHOST_DISTANCE_SQUARED
from .kernels.jit import inlined, kernel
from .state import State

# Particles whose bounds are compared in one iteration.
_LANES = 64
# Product of the reciprocal tributary lengths above which a particle is a corner.
_CORNER = 3


@inlined
def _direction(position, mobility, i, j, rest, factor, ghost, tiny):  # type: ignore[no-untyped-def]
    """Return the direction of a spring to j, and w and 1 − w times `factor`; zeros for a ghost."""
    one = position.dtype.type(1)
    x = position[0, i] - position[0, j]
    y = position[1, i] - position[1, j]
    z = position[2, i] - position[2, j]
    squared = x * x + (y * y + (z * z + tiny))
    root = one / np.sqrt(squared)
    along = min(one, rest * root)
    # Half where the other end is pinned.  Not a branch: that would keep the loop scalar.
    half = position.dtype.type(0.5)
    factor = factor * (half + half * min(mobility[0, j], one))
    if squared > ghost:
        root = factor = one - one
    return root * x, root * y, root * z, factor * along, factor * (one - along)


@inlined
def _overlap(a, b):  # type: ignore[no-untyped-def]
    return abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@inlined
def _bound(position, mobility, i, first, second, rest, f, g, ghost, tiny):  # type: ignore[no-untyped-def]
    """
    Return half the bound at particle i, in units of k/m, by its springs of two offsets.

    `f` and `g` are the reciprocal masses by which the springs of the offsets are multiplied.
    """
    a = _direction(position, mobility, i, i + first, rest[0], f, ghost, tiny)
    b = _direction(position, mobility, i, i - first, rest[0], f, ghost, tiny)
    c = _direction(position, mobility, i, i + second, rest[1], g, ghost, tiny)
    d = _direction(position, mobility, i, i - second, rest[1], g, ghost, tiny)
    p, q, r, s = a[3], b[3], c[3], d[3]
    ab, ac, ad = _overlap(a, b), _overlap(a, c), _overlap(a, d)
    bc, bd, cd = _overlap(b, c), _overlap(b, d), _overlap(c, d)
    greatest = max(
        max(p + q * ab + r * ac + s * ad, p * ab + q + r * bc + s * bd),
        max(p * ac + q * bc + r + s * cd, p * ad + q * bd + r * cd + s),
    )
    return greatest + a[4] + b[4] + c[4] + d[4]


@kernel
def _greatest_bound(position, mobility, begin, end, row, stiffness, rest, ghost, tiny):  # type: ignore[no-untyped-def]
    """Return the greatest bound of all particles; absent springs have no stiffness."""
    number = position.dtype.type
    row = np.uint64(row)
    greatest = np.zeros(_LANES, position.dtype)
    for start in range(np.uint64(begin), np.uint64(end), np.uint64(_LANES)):
        for lane in range(np.uint64(_LANES)):
            i = start + lane
            f, g = mobility[0, i], mobility[1, i]
            bound = stiffness[0] * _bound(
                position, mobility, i, stencil_offset(0, row), stencil_offset(1, row),
                rest[0], f, g, ghost, tiny,
            )  # fmt: skip
            bound += stiffness[1] * _bound(
                position, mobility, i, stencil_offset(2, row), stencil_offset(3, row),
                rest[1], f * g, f * g, ghost, tiny,
            )  # fmt: skip
            bound += stiffness[2] * _bound(
                position, mobility, i, stencil_offset(4, row), stencil_offset(5, row),
                rest[2], f, g, ghost, tiny,
            )  # fmt: skip
            if f * g > number(_CORNER):
                bound = number(0)
            greatest[lane] = max(greatest[lane], bound)
    for lane in range(np.uint64(1), np.uint64(_LANES)):
        greatest[0] = max(greatest[0], greatest[lane])
    return number(2) * greatest[0]


class PresentStiffness:
    """
    Bound of the stiffness of the springs of a cloth in its present state.

    Parameters
    ----------
    scene
        Its springs.

    """

    def __init__(self, scene: Scene) -> None:
        mass = scene.sheet.cell_mass
        self._stiffness = [getattr(scene.springs, name) / mass for name in SPRING_TYPES]
        # Of the two offsets of each type.
        rest = [rest_length(scene, rows, columns) for _, rows, columns in STENCIL]
        self._rest = list(zip(rest[::2], rest[1::2], strict=True))

    def bound(self, state: State) -> float:
        """Return a bound of the stiffness per unit mass, 1/s²; NaN or inf if it is not finite."""
        grid, number = state.grid, state.dtype
        return float(
            _greatest_bound(
                state.position,
                state.mobility,
                grid.begin,
                grid.end,
                grid.stride,
                tuple([number(each) for each in self._stiffness]),
                tuple([(number(first), number(second)) for first, second in self._rest]),
                number(GHOST_DISTANCE_SQUARED),
                number(COINCIDENT),
            )
        )
