"""A box, centred at its origin."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ...grid import Array
from ...kernels.jit import inlined
from .shape import (
    ONE,
    SLOPE,
    TILTED,
    TILTED_TWICE,
    TINY,
    ZERO,
    Shape,
    enclosing_capsule,
    reciprocal_root,
    to_local,
    to_world,
)

KIND = 3


@inlined
def distance(x, y, z, rotation, constants, rho, fields):  # type: ignore[no-untyped-def]
    """
    Return the distance from the offset box and the normal.

    Over a face, the offset is ρ at an edge and decreases along a ramp.  Outside of the edges and
    corners the surface is at the distance ρ from them.
    """
    zero, one = constants[ZERO], constants[ONE]
    x, y, z = to_local(rotation, x, y, z)
    # How far beyond the faces, of which the nearer one of each pair counts.
    xa, xb = x + constants[0], -x - constants[3]
    ya, yb = y + constants[1], -y - constants[4]
    za, zb = z + constants[2], -z - constants[5]
    a, b, c = max(xa, xb), max(ya, yb), max(za, zb)
    # Over the face of the largest; the ramps of the second largest tilt the normal, and of the
    # third too where they are equal but for rounding: a symmetric scene stays so.
    most, third = max(a, b, c), min(a, b, c)
    second = max(min(a, b), min(max(a, b), c))
    tie = second - constants[TINY]
    ramp = rho + constants[SLOPE] * second
    stretch = constants[TILTED_TWICE] if third >= tie else constants[TILTED]
    stretch = stretch if ramp > zero else one
    tilt = -constants[SLOPE] * stretch if ramp > zero else zero
    over_a = a >= most
    over_b = b >= most and not over_a
    u = stretch if over_a else (tilt if a >= tie else zero)
    v = stretch if over_b else (tilt if b >= tie else zero)
    w = (tilt if c >= tie else zero) if over_a or over_b else stretch
    # Beyond an edge or a corner.
    ea, eb, ec = max(a, zero), max(b, zero), max(c, zero)
    scale, length = reciprocal_root(one, max(ea * ea + eb * eb + ec * ec, constants[TINY]))
    beyond = second > zero
    u, v, w = scale * ea if beyond else u, scale * eb if beyond else v, scale * ec if beyond else w
    nx, ny, nz = to_world(
        rotation, u if xa >= xb else -u, v if ya >= yb else -v, w if za >= zb else -w
    )
    return length - rho if beyond else (most - max(ramp, zero)) * stretch, nx, ny, nz


def box(size: Sequence[float]) -> Shape:
    """Return a box with these lengths of its edges, m."""
    half = 0.5 * np.array(size)

    def reference(point: Array) -> Array:
        nearest: Array = np.clip(point, -half, half)
        return nearest

    def constants(point: Array) -> Sequence[float]:
        # Differences of large numbers are made here, in double precision.
        return (*(point - half), *(point + half))

    inner, middle, _ = np.sort(half)
    corners = half * np.array(list(itertools.product((-1, 1), repeat=3)))
    return Shape(
        KIND,
        math.hypot(*half),
        float(inner),
        float(middle),
        constants,
        reference,
        enclosing=enclosing_capsule(corners),
    )
