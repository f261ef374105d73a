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
def _locate(x, y, z, rotation, constants):  # type: ignore[no-untyped-def]
    """
    Return a point in cells from the first node, and the same moved into the grid.

    `constants` are the reference point from the first node, the reciprocal of the cell, the cell,
    and the number of cells along each axis; `MARGIN` is not used here.
    """
    zero = constants[ZERO]
    x, y, z = to_local(rotation, x, y, z)
    per_cell = constants[3]
    x, y, z = (
        (x + constants[0]) * per_cell,
        (y + constants[1]) * per_cell,
        (z + constants[2]) * per_cell,
    )
    # False for NaN, which must not become an index.
    a = min(x, constants[5]) if x > zero else zero
    b = min(y, constants[6]) if y > zero else zero
    c = min(z, constants[7]) if z > zero else zero
    return x, y, z, a, b, c


@inlined
def _cell(a, b, c, constants):  # type: ignore[no-untyped-def]
    """Return the first node of the cell of a point in the grid along each axis, not an integer."""
    one = constants[ONE]
    return (
        np.floor(min(a, constants[5] - one)),
        np.floor(min(b, constants[6] - one)),
        np.floor(min(c, constants[7] - one)),
    )


@inlined
def _node(fa, fb, fc, constants):  # type: ignore[no-untyped-def]
    """Return the flat index of the first node of a cell, and the steps along x and y."""
    one = constants[ONE]
    ly, lz = np.int32(constants[6] + one), np.int32(constants[7] + one)
    node = (np.int32(fa) * ly + np.int32(fb)) * lz + np.int32(fc)
    return np.uint64(node), np.uint64(lz * ly), np.uint64(lz)


@inlined
def _interpolate(f, p, q, r):  # type: ignore[no-untyped-def]
    """Return a number at a point of a cell, and its changes across the cell along x, y and z."""
    d00, d01, d10, d11 = f[1] - f[0], f[3] - f[2], f[5] - f[4], f[7] - f[6]
    e00, e01, e10, e11 = f[0] + r * d00, f[2] + r * d01, f[4] + r * d10, f[6] + r * d11
    g0, g1 = e01 - e00, e11 - e10
    h0, h1 = e00 + q * g0, e10 + q * g1
    lower, upper = d00 + q * (d01 - d00), d10 + q * (d11 - d10)
    return h0 + p * (h1 - h0), h1 - h0, g0 + p * (g1 - g0), lower + p * (upper - lower)


@inlined
def _eight(values, n, sx, sy):  # type: ignore[no-untyped-def]
    """Return the numbers at the nodes of a cell, in the order of x, y, z."""
    t = np.uint64(1)
    return (
        values[n], values[n + t], values[n + sy], values[n + sy + t],
        values[n + sx], values[n + sx + t], values[n + sx + sy], values[n + sx + sy + t],
    )  # fmt: skip


@inlined
def distance(x, y, z, rotation, constants, rho, fields):  # type: ignore[no-untyped-def]
    """
    Return the distance from the offset mesh and the normal.

    `fields` has the distances and the shares of ρ of the nodes, flat, and where those of this mesh
    begin.
    """
    values, shares, start = fields
    zero, one = constants[ZERO], constants[ONE]
    x, y, z, a, b, c = _locate(x, y, z, rotation, constants)
    fa, fb, fc = _cell(a, b, c, constants)
    n, sx, sy = _node(fa, fb, fc, constants)
    p, q, r = a - fa, b - fb, c - fc
    value, gx, gy, gz = _interpolate(_eight(values, start + n, sx, sy), p, q, r)
    share, tx, ty, tz = _interpolate(_eight(shares, start + n, sx, sy), p, q, r)
    # Beyond the grid, which contains the mesh: no point of that is nearer.
    cell = constants[4]
    u, v, w = (x - a) * cell, (y - b) * cell, (z - c) * cell
    squared = u * u + v * v + w * w
    value = np.sqrt(squared + value * value) if squared > zero else value
    # The offset changes beside edges: its surface is inclined to that of the mesh.
    gx, gy, gz = gx - rho * tx, gy - rho * ty, gz - rho * tz
    scale = one / np.sqrt(max(gx * gx + gy * gy + gz * gz, constants[TINY]))
    nx, ny, nz = to_world(rotation, scale * gx, scale * gy, scale * gz)
    return value - share * rho, nx, ny, nz
