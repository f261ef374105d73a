"""Distance of a point from a collider of any shape, in double precision."""

from __future__ import annotations

from ..kernels.jit import exact_subroutine
from .particle_contact import INSET, SHAPE
from .shapes import mesh_distance
from .shapes.by_kind import DISTANCES, by_kind

_distance = by_kind(DISTANCES.keys(), lambda kind: DISTANCES[kind])


@exact_subroutine
def distance_from(kind, row, fields, x, y, z, rho):  # type: ignore[no-untyped-def]
    """
    Return the distance of a point from a collider, and the normal, as (distance, nx, ny, nz).

    Parameters
    ----------
    kind, row
        Of the collider, see `particle_contact`; its position is not used.
    fields
        Distances and shares of a mesh, flat.
    x, y, z
        The point, m, from the reference point in the axes of the state.
    rho
        Circumradius of triangles, m; 0: for the distance from the true surface, or from a surface
        that encloses it, see `mesh_distance.MARGIN`.

    """
    constants = (
        row[SHAPE], row[SHAPE + 1], row[SHAPE + 2], row[SHAPE + 3], row[SHAPE + 4],
        row[SHAPE + 5], row[SHAPE + 6], row[SHAPE + 7], row[SHAPE + 8], row[SHAPE + 9],
        row[SHAPE + 10], row[SHAPE + 11], row[SHAPE + 12], row[SHAPE + 13], row[SHAPE + 14],
        row[SHAPE + 15], row[SHAPE + 16], row[SHAPE + 17], row[SHAPE + 18],
    )  # fmt: skip
    rotation = (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])
    if kind == mesh_distance.KIND:
        rho = rho + row[SHAPE + mesh_distance.MARGIN]
    d, a, b, c = _distance(kind, x, y, z, rotation, constants, rho, fields)
    return d + row[INSET], a, b, c


@exact_subroutine
def in_own_frame(row):  # type: ignore[no-untyped-def]
    """Return a row for points in the frame of the collider."""
    own = row.copy()
    for k in range(9):
        own[k] = 1.0 if k % 4 == 0 else 0.0
    return own
