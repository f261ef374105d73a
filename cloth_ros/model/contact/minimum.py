"""Least number of a block of particles, vectorised although NaN is possible."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import inlined
from .particle_contact import BLOCK

# Numbers that are compared with others in one step.
_LANES = 16


@inlined
def least(values, first, most):  # type: ignore[no-untyped-def]
    """
    Return the least of `most` and `BLOCK` values from `first` on; NaN is ignored.

    LLVM does not vectorise the minimum of an array that may hold NaN; lane by lane, it does.
    """
    lanes = np.full(_LANES, most, values.dtype)
    for begin in range(np.uint64(first), np.uint64(first + BLOCK), np.uint64(_LANES)):
        for lane in range(np.uint64(_LANES)):
            value = values[begin + lane]
            lanes[lane] = value if value < lanes[lane] else lanes[lane]
    nearest = most
    for lane in range(np.uint64(_LANES)):
        nearest = min(nearest, lanes[lane])
    return nearest


@inlined
def least_of_all(values, most):  # type: ignore[no-untyped-def]
    """Return the least of `most` and all values, whose number is a multiple of `BLOCK`."""
    nearest = most
    for first in range(0, len(values), BLOCK):
        nearest = min(nearest, least(values, first, most))
    return nearest
