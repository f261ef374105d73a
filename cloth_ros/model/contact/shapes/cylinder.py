"""A cylinder about the local z axis, centred at its origin."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...grid import Array
from ...kernels.jit import inlined
from .shape import ONE, SLOPE, TINY, ZERO, Enclosing, Shape, to_local, to_world

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
    wide = np.sqrt(max(x * x + y * y, constants[TINY]))
    p, q = x / wide, y / wide
    up = one if z >= zero else -one
    a, b = wide - radius, up * z - half  # how far beyond barrel and cap
    curved = rho * rho / (np.sqrt(radius * radius + rho * rho) + radius)
    most, second = max(a, b), min(a, b)
    ramp = rho + constants[SLOPE] * second
    least = curved if a > b else zero
    tilt = constants[SLOPE] if ramp > least else zero
    stretch = one / np.sqrt(one + tilt * tilt)
    over_face = (most - max(ramp, least)) * stretch
    u = stretch * (one if a > b else -tilt)
    w = stretch * (-tilt if a > b else one)
    length = np.sqrt(max(a * a + b * b, constants[TINY]))
    beyond = second > zero
    u = a / length if beyond else u
    w = b / length if beyond else w
    nx, ny, nz = to_world(rotation, p * u, q * u, up * w)
    return length - rho if beyond else over_face, nx, ny, nz


def cylinder(radius: float, length: float) -> Shape:
    """Return a cylinder of a radius and a length, m."""
    half = 0.5 * length

    def reference(point: Array) -> Array:
        return np.array([0.0, 0.0, min(max(point[2], -half), half)])

    def constants(point: Array) -> Sequence[float]:
        return (*point, half, radius)

    return Shape(
        KIND,
        math.hypot(half, radius),
        min(half, radius),
        radius,
        constants,
        reference,
        enclosing=Enclosing(radius, length, np.zeros(3), np.eye(3)),
    )
