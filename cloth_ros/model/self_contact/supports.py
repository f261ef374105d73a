"""Colliders that support the particles of a sheet in contact with itself."""

from __future__ import annotations

import math

import numpy as np

from ..contact.distance import distance_from
from ..contact.particle_contact import POINT, SLOP, SPIN, VELOCITY
from ..kernels.jit import exact

# Least velocity along a normal, m/s, of a particle that nothing supports.
UNSUPPORTED = -math.inf


@exact
def find_supports(  # type: ignore[no-untyped-def]
    position, particles, rho, kind, row, fields, tolerance, supports
):
    """
    Note where particles are in touch with a collider.

    Parameters
    ----------
    position
        Flat array, m.
    particles
        Flat indices of those that are looked at.
    rho
        Bound of the circumradius of the triangles of each particle, m, a flat array.
    kind, row, fields
        Of the collider, see `distance_from`.
    tolerance
        Gap, m, up to which a particle is in touch.
    supports
        Receives normal and least velocity along it, m/s, of these particles: shape (size, 4).

    """
    number = supports.dtype.type
    for particle in particles:
        i = np.uint64(particle)
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
        supports[i, 0], supports[i, 1], supports[i, 2] = number(nx), number(ny), number(nz)
        supports[i, 3] = number(u * nx + v * ny + w * nz)
