"""A capsule: all points within a radius of a segment of the local z axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...grid import Array
from ...kernels.jit import inlined
from .shape import ONE, TINY, Shape, reciprocal_root, to_local, to_world

KIND = 2


@inlined
def distance(x, y, z, rotation, constants, rho, fields):  # type: ignore[no-untyped-def]
    """Return the distance from the offset capsule and the normal."""
    x, y, z = to_local(rotation, x, y, z)
    x, y, z = x + constants[0], y + constants[1], z + constants[2]
    half, radius = constants[3], constants[4]
    z -= min(max(z, -half), half)
    one = constants[ONE]
    scale, length = reciprocal_root(one, max(x * x + y * y + z * z, constants[TINY]))
    _, reach = reciprocal_root(one, radius * radius + rho * rho)
    nx, ny, nz = to_world(rotation, scale * x, scale * y, scale * z)
    return length - reach, nx, ny, nz


def capsule(radius: float, length: float) -> Shape:
    """Return a capsule of a radius, and of a length of its straight part, m."""
    half = 0.5 * length

    def reference(point: Array) -> Array:
        return np.array([0.0, 0.0, min(max(point[2], -half), half)])

    def constants(point: Array) -> Sequence[float]:
        return (*point, half, radius)

    return Shape(KIND, half + radius, radius, radius, constants, reference)
