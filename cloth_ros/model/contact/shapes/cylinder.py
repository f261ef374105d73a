"""A cylinder about the local z axis, centred at its origin."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...grid import Array
from ...kernels.jit import inlined
from .shape import (
    ONE,
    SLOPE,
    TILTED,
    TINY,
    ZERO,
    Enclosing,
    Shape,
    reciprocal_root,
    to_local,
    to_world,
)

KIND = 4


@inlined
def distance(x, y, z, rotation, constants, rho, fields):  # type: ignore[no-untyped-def]
    """
    Return the distance from the offset cylinder and the normal.

    The barrel has the offset of a sphere of its radius, a cap that of a plane, and both have the
    ramp of a box beside the rim.
    """
    zero, one = constants[ZERO], constants[ONE]
    x, y, z = to_local(rotation, x, y, z)
    x, y, z = x + constants[0], y + constants[1], z + constants[2]
    half, radius = constants[3], constants[4]
    per_wide, wide = reciprocal_root(one, max(x * x + y * y, constants[TINY]))
    up = one if z >= zero else -one
    a, b = wide - radius, up * z - half  # how far beyond barrel and cap
    curved = constants[5] * rho * rho
    most, second = max(a, b), min(a, b)
    ramp = rho + constants[SLOPE] * second
    level = curved if a > b else zero
    tilted = ramp > level
    stretch = constants[TILTED] if tilted else one
    tilt = constants[SLOPE] * stretch if tilted else zero
    u = stretch if a > b else -tilt
    w = -tilt if a > b else stretch
    scale, length = reciprocal_root(one, max(a * a + b * b, constants[TINY]))
    beyond = second > zero
    u, w = scale * a if beyond else u, scale * b if beyond else w
    u = per_wide * u
    nx, ny, nz = to_world(rotation, x * u, y * u, up * w)
    return length - rho if beyond else (most - max(ramp, level)) * stretch, nx, ny, nz


def cylinder(radius: float, length: float) -> Shape:
    """Return a cylinder of a radius and a length, m."""
    half = 0.5 * length

    def reference(point: Array) -> Array:
        return np.array([0.0, 0.0, min(max(point[2], -half), half)])

    def constants(point: Array) -> Sequence[float]:
        return (*point, half, radius, 0.5 / radius)

    return Shape(
        KIND,
        math.hypot(half, radius),
        min(half, radius),
        radius,
        constants,
        reference,
        enclosing=Enclosing(radius, length, np.zeros(3), np.eye(3)),
    )
