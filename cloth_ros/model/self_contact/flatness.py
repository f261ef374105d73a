"""
Parts of the sheet that are too flat to touch themselves.

A block of cells whose edges all point nearly the same way cannot touch itself.  With the unit
vectors u along the rows and v along the columns of a block, orthogonal to each other, let a be
the least component of its edges along their own direction, and b the greatest along the other.
Two points that are p cells apart along the rows and q along the columns are then
(a p - b q, a q - b p) apart at least along u and v, by the mean value theorem.
"""

from __future__ import annotations

import math

import numpy as np

from ..kernels.jit import exact_inlined

# Features that share no particle are half a cell apart at least, along rows and columns both, or
# a whole cell along either.
NEAREST = math.sqrt(0.5)
# Length of the bounds of edges: least and greatest vector along the rows, and along the columns.
EDGES = 12


@exact_inlined
def _component(box, n, x, y, z):  # type: ignore[no-untyped-def]
    """Return the middle and the half width of the bounds of a component of edges."""
    middle = 0.5 * (
        x * (box[n] + box[n + 3]) + y * (box[n + 1] + box[n + 4]) + z * (box[n + 2] + box[n + 5])
    )
    half = 0.5 * (
        abs(x) * (box[n + 3] - box[n])
        + abs(y) * (box[n + 4] - box[n + 1])
        + abs(z) * (box[n + 5] - box[n + 2])
    )
    return middle, half


@exact_inlined
def least_distance(box, change):  # type: ignore[no-untyped-def]
    """
    Return the least distance, m, of features of a block that share no particle.

    Parameters
    ----------
    box
        Bounds of the edge vectors, m, shape (EDGES,).
    change
        By how much two edges may change together, m.

    """
    ux, uy, uz = box[0] + box[3], box[1] + box[4], box[2] + box[5]
    vx, vy, vz = box[6] + box[9], box[7] + box[10], box[8] + box[11]
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    common = ux * vx + uy * vy + uz * vz
    vx, vy, vz = vx - common * ux, vy - common * uy, vz - common * uz
    length = np.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx / length, vy / length, vz / length
    own, half_own = _component(box, 0, ux, uy, uz)
    other, half_other = _component(box, 6, vx, vy, vz)
    along = min(own - half_own, other - half_other)
    own, half_own = _component(box, 0, vx, vy, vz)
    other, half_other = _component(box, 6, ux, uy, uz)
    across = max(abs(own) + half_own, abs(other) + half_other)
    # Not a number, and so not above any distance, where a length is zero.
    return NEAREST * (along - across - change)
