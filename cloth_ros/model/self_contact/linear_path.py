"""
Proof that a pair of features does not pass through each other on a linear path.

If one plane normal separates two convex bodies at the start and at the end of a linear motion of
their corners, it separates them in between, because the width of the gap along a fixed direction
is a concave function of time.  Where no single normal does, the path is divided.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact_subroutine
from .closest_features import closest, separation

# Shortest part of a path.
_SHORTEST = 2.0**-12


@exact_subroutine
def _place(out, before, after, i, j, k, h, t):  # type: ignore[no-untyped-def]
    """Write the positions of four particles at a share t of their path."""
    for axis in range(3):
        out[0, axis] = before[i, axis] + t * (after[i, axis] - before[i, axis])
        out[1, axis] = before[j, axis] + t * (after[j, axis] - before[j, axis])
        out[2, axis] = before[k, axis] + t * (after[k, axis] - before[k, axis])
        out[3, axis] = before[h, axis] + t * (after[h, axis] - before[h, axis])


@exact_subroutine
def stays_apart(before, after, edges, i, j, k, h, least):  # type: ignore[no-untyped-def]
    """
    Return True only if a pair of features is farther apart than `least`, m, all along its path.

    Parameters
    ----------
    before, after
        Positions, m, shape (n, 3), at the start and at the end of the linear path.
    edges, i, j, k, h
        The pair, see `closest`.
    least
        m, more than 0.

    """
    start, middle, end = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    t, length = 0.0, 1.0
    while t < 1.0:
        _place(start, before, after, i, j, k, h, t)
        _place(middle, before, after, i, j, k, h, t + 0.5 * length)
        _place(end, before, after, i, j, k, h, t + length)
        _, nx, ny, nz, _, _, _, _ = closest(middle, edges, 0, 1, 2, 3)
        if (
            separation(start, edges, 0, 1, 2, 3, nx, ny, nz) > least
            and separation(end, edges, 0, 1, 2, 3, nx, ny, nz) > least
        ):
            t += length
            length = min(2.0 * length, 1.0 - t)
        else:
            length *= 0.5
            if length < _SHORTEST:
                return False
    return True
