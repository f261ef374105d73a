"""Distance from a mesh, interpolated in its grid of distances, for the kernels of contact."""

from __future__ import annotations

import numpy as np

from ...kernels.jit import inlined
from .shape import ONE, TINY, ZERO, to_local, to_world

KIND = 5
# Number of the constant that is the circumradius, m, whose offset is as large as the error of the
# grid.  Triangles are kept out of that offset: at sharp edges the true surface is outside of the
# interpolated one.
MARGIN = 8


@inlined
def distance(x, y, z, rotation, constants, rho, fields):  # type: ignore[no-untyped-def]
    """
    Return the distance from the offset mesh and the normal.

    `fields` has the distances and the shares of ρ of the nodes, flat, and where those of this mesh
    begin; the constants are the
    reference point from the first node, the reciprocal of the cell, the cell, and the number of
    cells along each axis; `MARGIN` is not used here.
    """
    values, shares, start = fields
    zero, one = constants[ZERO], constants[ONE]
    x, y, z = to_local(rotation, x, y, z)
    # In cells from the first node; a point outside of the grid is moved to its boundary.
    per_cell, cell = constants[3], constants[4]
    x, y, z = (
        (x + constants[0]) * per_cell,
        (y + constants[1]) * per_cell,
        (z + constants[2]) * per_cell,
    )
    # False for NaN, which must not become an index.
    a = min(x, constants[5]) if x > zero else zero
    b = min(y, constants[6]) if y > zero else zero
    c = min(z, constants[7]) if z > zero else zero
    fa = np.floor(min(a, constants[5] - one))
    fb = np.floor(min(b, constants[6] - one))
    fc = np.floor(min(c, constants[7] - one))
    i, j, k = np.int32(fa), np.int32(fb), np.int32(fc)
    ly, lz = np.int32(constants[6] + one), np.int32(constants[7] + one)
    p, q, r = a - fa, b - fb, c - fc
    n = start + np.uint64((i * ly + j) * lz + k)
    sy, sx = np.uint64(lz), np.uint64(lz * ly)
    t = np.uint64(1)
    f000, f001 = values[n], values[n + t]
    f010, f011 = values[n + sy], values[n + sy + t]
    f100, f101 = values[n + sx], values[n + sx + t]
    f110, f111 = values[n + sx + sy], values[n + sx + sy + t]
    # Along z, then y, then x; the differences are the gradient.
    d00, d01, d10, d11 = f001 - f000, f011 - f010, f101 - f100, f111 - f110
    e00, e01, e10, e11 = f000 + r * d00, f010 + r * d01, f100 + r * d10, f110 + r * d11
    g0, g1 = e01 - e00, e11 - e10
    h0, h1 = e00 + q * g0, e10 + q * g1
    gx = h1 - h0
    value = h0 + p * gx
    gy = g0 + p * (g1 - g0)
    lower, upper = d00 + q * (d01 - d00), d10 + q * (d11 - d10)
    gz = lower + p * (upper - lower)
    s00 = shares[n] + r * (shares[n + t] - shares[n])
    s01 = shares[n + sy] + r * (shares[n + sy + t] - shares[n + sy])
    s10 = shares[n + sx] + r * (shares[n + sx + t] - shares[n + sx])
    s11 = shares[n + sx + sy] + r * (shares[n + sx + sy + t] - shares[n + sx + sy])
    s0, s1 = s00 + q * (s01 - s00), s10 + q * (s11 - s10)
    share = s0 + p * (s1 - s0)
    # Beyond the grid, which contains the mesh: no point of that is nearer.
    u, v, w = (x - a) * cell, (y - b) * cell, (z - c) * cell
    squared = u * u + v * v + w * w
    value = np.sqrt(squared + value * value) if squared > zero else value
    scale = one / np.sqrt(max(gx * gx + gy * gy + gz * gz, constants[TINY]))
    nx, ny, nz = to_world(rotation, scale * gx, scale * gy, scale * gz)
    return value - share * rho, nx, ny, nz
