"""A sphere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...grid import Array
from ...kernels.jit import inlined
from .shape import FAR, HALF, ONE, TINY, Shape, reciprocal_root, to_world

KIND = 1


@inlined
def distance(x, y, z, rotation, constants, rho, fields):  # type: ignore[no-untyped-def]
    """
    Return the distance from the offset sphere and the normal.

    The reference point p is on the sphere.  With n the normal there and κ = 1/R, a point at y from
    p is R √(1 + 2 κ s) from the centre, s = n·y + κ y²/2, and so 2 s/(1 + √(1 + 2 κ s)) from the
    sphere: no difference of two large numbers, however large the sphere.
    """
    kappa = constants[0]
    nx, ny, nz = to_world(rotation, constants[1], constants[2], constants[3])
    one = constants[ONE]
    s = nx * x + ny * y + nz * z + constants[HALF] * kappa * (x * x + y * y + z * z)
    s = min(s, constants[FAR])  # of a ghost, whose square is no number in single precision
    squared = max(one + (kappa + kappa) * s, constants[TINY])
    scale, root = reciprocal_root(one, squared)
    share, _ = reciprocal_root(one, one + root)
    half = constants[HALF]
    flat = half * kappa * kappa * rho * rho
    offset = half * kappa * rho * rho * (one - half * min(flat, half) * (one - min(flat, half)))
    return (
        (s + s) * share * share - offset,
        scale * (nx + kappa * x),
        scale * (ny + kappa * y),
        scale * (nz + kappa * z),
    )


def sphere(radius: float) -> Shape:
    """Return a sphere of a radius, m."""

    def reference(point: Array) -> Array:
        length = float(np.linalg.norm(point))
        nearest: Array = point * (radius / length) if length > 0 else np.array([0, 0, radius])
        return nearest

    def constants(point: Array) -> Sequence[float]:
        return (1 / radius, *(point / radius))

    return Shape(KIND, radius, radius, radius, constants, reference)
