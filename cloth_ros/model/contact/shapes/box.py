"""A box, centred at its origin."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ...grid import Array
from ...kernels.jit import inlined
from .shape import ONE, SLOPE, TINY, ZERO, Shape, enclosing_capsule, to_local, to_world

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
    sa = one if xa >= xb else -one
    sb = one if ya >= yb else -one
    sc = one if za >= zb else -one
    # Over a face: the axes of the largest and of the second largest.
    most = max(a, b, c)
    ma = one if a >= most else zero
    mb = (one if b >= most else zero) * (one - ma)
    mc = one - ma - mb
    second = max(min(a, b), min(max(a, b), c))  # the median
    # Both axes where they are equal but for rounding: a symmetric scene stays so.
    tie = second - constants[TINY]
    na = (one if a >= tie else zero) * (one - ma)
    nb = (one if b >= tie else zero) * (one - mb)
    nc = (one if c >= tie else zero) * (one - mc)
    ramp = rho + constants[SLOPE] * second
    tilt = constants[SLOPE] if ramp > zero else zero
    stretch = one / np.sqrt(one + tilt * tilt * (na + nb + nc))
    over_face = (most - max(ramp, zero)) * stretch
    # Beyond an edge or a corner.
    ea, eb, ec = max(a, zero), max(b, zero), max(c, zero)
    length = np.sqrt(max(ea * ea + eb * eb + ec * ec, constants[TINY]))
    scale = one / length
    beyond = second > zero
    u = scale * ea if beyond else stretch * (ma - tilt * na)
    v = scale * eb if beyond else stretch * (mb - tilt * nb)
    w = scale * ec if beyond else stretch * (mc - tilt * nc)
    nx, ny, nz = to_world(rotation, sa * u, sb * v, sc * w)
    return length - rho if beyond else over_face, nx, ny, nz


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
