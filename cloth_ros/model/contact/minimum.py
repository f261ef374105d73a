"""Least number of an array, vectorised although NaN is possible."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import inlined
from .particle_contact import BLOCK


@inlined
def least(values, most):  # type: ignore[no-untyped-def]
    """
    Return the least of `most` and all values, whose number is a multiple of `BLOCK`.

    NaN is ignored.  LLVM does not vectorise the minimum of an array that may hold NaN; lane by
    lane, it does.
    """
    lanes = np.full(BLOCK, most, values.dtype)
    for first in range(np.uint64(0), np.uint64(len(values)), np.uint64(BLOCK)):
        for lane in range(np.uint64(BLOCK)):
            value = values[first + lane]
            lanes[lane] = value if value < lanes[lane] else lanes[lane]
    nearest = most
    for lane in range(np.uint64(BLOCK)):
        nearest = min(nearest, lanes[lane])
    return nearest
