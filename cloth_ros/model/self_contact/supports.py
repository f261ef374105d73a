"""Colliders that support the particles of a sheet in contact with itself."""

from __future__ import annotations

from ..contact.distance import distance_from
from ..contact.particle_contact import POINT, SLOP, SPIN, VELOCITY
from ..kernels.jit import exact


@exact
def find_supports(  # type: ignore[no-untyped-def]
    now, rho, begin, stride, columns, kind, row, fields, seconds, supports
):
    """
    Note where a collider is nearer than others, and the least velocity of particles there.

    Parameters
    ----------
    now
        Positions, m, shape (n, 3), double precision.
    rho, begin, stride, columns
        Bound of the circumradius of the triangles of each particle, m, a flat array, and its
        layout.
    kind, row, fields
        Of the collider, see `distance_from`.
    seconds
        Duration of a part, s.
    supports
        Normal, and least velocity along it, m/s, of each particle: shape (n, 4); changed where
        this collider allows less.

    """
    for n in range(len(now)):
        i = begin + n // columns * stride + n % columns
        x, y, z = now[n, 0] - row[POINT], now[n, 1] - row[POINT + 1], now[n, 2] - row[POINT + 2]
        gap, nx, ny, nz = distance_from(kind, row, fields, x, y, z, rho[i])
        u = row[VELOCITY] + row[SPIN] * x + row[SPIN + 1] * y + row[SPIN + 2] * z
        v = row[VELOCITY + 1] + row[SPIN + 3] * x + row[SPIN + 4] * y + row[SPIN + 5] * z
        w = row[VELOCITY + 2] + row[SPIN + 6] * x + row[SPIN + 7] * y + row[SPIN + 8] * z
        least = u * nx + v * ny + w * nz - max(gap - row[SLOP], 0.0) / seconds
        if least > supports[n, 3]:
            supports[n, 0], supports[n, 1], supports[n, 2], supports[n, 3] = nx, ny, nz, least
