"""Which parts of a sheet are near a collider, and how deep its particles are in it."""

from __future__ import annotations

import numpy as np

from ..grid import GHOST
from ..kernels.jit import exact, exact_subroutine, kernel
from .deepest_point import deepest_point
from .distance import distance_from, in_own_frame
from .particle_contact import BLOCK, POINT
from .sheet_bounds import longest_edges

# Factor on the expected size of triangles from which on they count as larger.
_LARGER = 1.002


@exact_subroutine
def _distance_at(kind, row, fields, x, y, z, rho):  # type: ignore[no-untyped-def]
    """Return the distance of a point of the state from a collider."""
    x, y, z = x - row[POINT], y - row[POINT + 1], z - row[POINT + 2]
    return distance_from(kind, row, fields, x, y, z, rho)[0]


@exact
def depth_of_particles(position, begin, end, kind, row, fields, rho):  # type: ignore[no-untyped-def]
    """Return the greatest depth of a particle in the offset surface of a collider, m, or less."""
    depth = -np.inf
    for i in range(begin, end):
        if position[0, i] < 0.1 * GHOST:
            x, y, z = np.float64(position[0, i]), np.float64(position[1, i]), position[2, i]
            depth = max(depth, -_distance_at(kind, row, fields, x, y, z, rho))
    return depth


@kernel
def has_grown(position, begin, end, stride, rho, active, cells):  # type: ignore[no-untyped-def]
    """
    Return whether triangles near a collider are larger than `rho` says.

    Parameters
    ----------
    position, begin, end, stride
        Of the sheet, as in `Grid` and `State`.
    rho, active
        As in `ContactTable`.
    cells
        Scratch, shape (size,).

    """
    number = position.dtype.type
    zero, one, factor = number(0), number(1), number(4.0 * _LARGER)
    row, step = np.uint64(stride), np.uint64(1)
    longest_edges(position, np.uint64(begin) - row - step, np.uint64(end), row, cells)
    for block in range(active.shape[1]):
        near = 0
        for n in range(len(active)):
            near += active[n, block]
        if near == 0:
            continue
        first, larger = np.uint64(begin + block * BLOCK), zero
        for i in range(first, first + np.uint64(BLOCK)):
            squared = max(
                max(cells[i], cells[i - step]), max(cells[i - row], cells[i - row - step])
            )
            larger += one if squared > factor * rho[i] * rho[i] else zero
        if larger > zero:
            return True
    return False


@exact
def triangles_cut(  # type: ignore[no-untyped-def]
    position, begin, end, stride, rho, active, cells, kind, row, fields, depth
):
    """
    Return whether a triangle that is larger than `rho` says is deeper in a collider than `depth`.

    With `rho` all 0, every triangle is looked at.

    Parameters
    ----------
    position, begin, end, stride, rho, cells
        As in `has_grown`, which must have been called before.
    active
        Of the collider, as in `ContactTable`, shape (blocks,).
    kind, row, fields
        Of the collider about its origin, see `particle_contact`.
    depth
        m.

    """
    points = np.empty((4, 3))
    shape = (kind, in_own_frame(row), fields)
    for block in range(len(active)):
        if active[block] == 0:
            continue
        for i in range(begin + block * BLOCK, min(begin + (block + 1) * BLOCK, end)):
            whole = True
            least = np.inf
            for k in range(4):
                j = i + (k % 2) + (k // 2) * stride
                whole = whole and position[0, j] < 0.1 * GHOST
                least = min(least, np.float64(rho[j]))
            if not whole or not cells[i] > 4.0 * _LARGER * least * least:
                continue
            for k in range(4):
                j = i + (k % 2) + (k // 2) * stride
                x = position[0, j] - row[POINT]
                y = position[1, j] - row[POINT + 1]
                z = position[2, j] - row[POINT + 2]
                points[k, 0] = row[0] * x + row[3] * y + row[6] * z
                points[k, 1] = row[1] * x + row[4] * y + row[7] * z
                points[k, 2] = row[2] * x + row[5] * y + row[8] * z
            for k in range(4):  # each triangle leaves out one corner
                a, b, c = (k + 1) % 4, (k + 2) % 4, (k + 3) % 4
                if deepest_point(points, a, b, c, shape, -depth, 0.1 * depth)[0] < -depth:
                    return True
    return False
