"""A plane: local z = 0, with the sheet on the side of positive z."""

from __future__ import annotations

import math

import numpy as np

from ...grid import Array
from ...kernels.jit import inlined
from .shape import Shape

KIND = 0


@inlined
def distance(x, y, z, rotation, constants, rho, fields):  # type: ignore[no-untyped-def]
    """Return the distance from the plane and its normal."""
    nx, ny, nz = rotation[2], rotation[5], rotation[8]
    return nx * x + ny * y + nz * z, nx, ny, nz


def _reference(point: Array) -> Array:
    return np.array([point[0], point[1], 0.0])


def plane() -> Shape:
    """Return the plane."""
    return Shape(KIND, math.inf, math.inf, math.inf, lambda _: (), _reference)
