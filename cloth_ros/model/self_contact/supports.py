"""Colliders that support the particles of a sheet in contact with itself."""

from __future__ import annotations

import math

from ..contact.distance import distance_from
from ..contact.particle_contact import POINT, SLOP, SPIN, VELOCITY
from ..kernels.jit import exact

# Least velocity along a normal, m/s, of a particle that nothing supports.
UNSUPPORTED = -math.inf


@exact
def find_supports(  # type: ignore[no-untyped-def]
    position, chosen, rho, begin, stride, columns, kind, row, fields, tolerance, supports
):
    """
    Note where particles are in touch with a collider.

    Parameters
    ----------
    position
        Flat array, m.
    chosen
        Particles that are looked at, by row and column.
    rho, begin, stride, columns
        Bound of the circumradius of the triangles of each particle, m, a flat array, and its
        layout.
    kind, row, fields
        Of the collider, see `distance_from`.
    tolerance
        Gap, m, up to which a particle is in touch.
    supports
        Receives normal and least velocity along it, m/s, of these particles: shape (4, size).

    """
    number = supports.dtype.type
    for n in chosen:
        i = begin + n // columns * stride + n % columns
        x, y, z = (
            position[0, i] - row[POINT],
            position[1, i] - row[POINT + 1],
            position[2, i] - row[POINT + 2],
        )
        gap, nx, ny, nz = distance_from(kind, row, fields, x, y, z, rho[i])
        if gap - row[SLOP] > tolerance:
            continue
        u = row[VELOCITY] + row[SPIN] * x + row[SPIN + 1] * y + row[SPIN + 2] * z
        v = row[VELOCITY + 1] + row[SPIN + 3] * x + row[SPIN + 4] * y + row[SPIN + 5] * z
        w = row[VELOCITY + 2] + row[SPIN + 6] * x + row[SPIN + 7] * y + row[SPIN + 8] * z
        supports[0, i], supports[1, i], supports[2, i] = number(nx), number(ny), number(nz)
        supports[3, i] = number(u * nx + v * ny + w * nz)
