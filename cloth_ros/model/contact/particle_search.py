"""Search for the particles that colliders may touch in a batch of substeps."""

# A branch on a constant must be nested: joined to another condition it would be compiled.
# ruff: noqa: SIM102

from __future__ import annotations

import functools
from collections.abc import Set

import numpy as np

from ..grid import GHOST
from ..kernels.jit import Kernel, inlined, kernel
from .particle_contact import BLOCK, load_row
from .shapes import box, capsule, cylinder, mesh_distance, plane, sphere
from .shapes.shape import Distance


def _search_loop(distance: Distance) -> Kernel:
    @inlined
    def loop(position, velocity, begin, end, rho, rows, n, fields, seconds, approach, active):  # type: ignore[no-untyped-def]
        """Mark the blocks in reach of collider n; return the least gap that is left, m."""
        number = velocity.dtype.type
        rotation, point, _, _, others, constants = load_row(rows, np.int64(0), n)
        px, py, pz = point
        inset, h, far = others[0], number(seconds), number(0.1 * GHOST)
        clearance = far
        for block in range(active.shape[1]):
            first = np.uint64(begin + block * BLOCK)
            last = np.uint64(min(begin + (block + 1) * BLOCK, end))
            nearest = far
            for i in range(first, last):
                x, y, z = position[0, i] - px, position[1, i] - py, position[2, i] - pz
                gap, _, _, _ = distance(x, y, z, rotation, constants, rho[i], fields)
                u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
                # What is left if all move towards the shape for so many s.
                gap += inset - h * np.sqrt(u * u + v * v + w * w)
                # Not of a ghost, which may be on either side of a plane.
                gap = gap if position[0, i] < far else far
                # False for NaN.
                nearest = gap if gap < nearest else nearest
            active[n, block] = 0 if nearest > approach else 1
            clearance = min(clearance, nearest)
        return clearance

    return loop


_to_plane = _search_loop(plane.distance)
_to_sphere = _search_loop(sphere.distance)
_to_capsule = _search_loop(capsule.distance)
_to_box = _search_loop(box.distance)
_to_cylinder = _search_loop(cylinder.distance)
_to_mesh = _search_loop(mesh_distance.distance)


@functools.cache
def compose_search(kinds: Set[int]) -> Kernel:
    """
    Compile the search for the blocks of particles that colliders may touch in a batch.

    Parameters of the kernel
    ------------------------
    position, velocity, begin, end
        Of the sheet, as in `Grid` and `State`.
    seconds
        Length of the batch, s.
    contacts
        A `ContactTable`, whose `active` is written.
    approaches
        By how much each collider may move in the batch, m, shape (colliders,).
    clearances
        Receives a bound of the distance that is left between the sheet and each collider, m.

    """
    has_plane, has_sphere = plane.KIND in kinds, sphere.KIND in kinds
    has_capsule, has_box = capsule.KIND in kinds, box.KIND in kinds
    has_cylinder, has_mesh = cylinder.KIND in kinds, mesh_distance.KIND in kinds

    @kernel
    def search(position, velocity, begin, end, seconds, contacts, approaches, clearances):  # type: ignore[no-untyped-def]
        types, rows, active, rho, values, shares, starts, _ = contacts
        for n in range(len(types)):
            kind = types[n]
            fields = (values, shares, np.uint64(starts[n]))
            if has_plane:
                if kind == plane.KIND:
                    clearances[n] = _to_plane(
                        position, velocity, begin, end, rho, rows, n, fields, seconds,
                        approaches[n], active,
                    )  # fmt: skip
            if has_sphere:
                if kind == sphere.KIND:
                    clearances[n] = _to_sphere(
                        position, velocity, begin, end, rho, rows, n, fields, seconds,
                        approaches[n], active,
                    )  # fmt: skip
            if has_capsule:
                if kind == capsule.KIND:
                    clearances[n] = _to_capsule(
                        position, velocity, begin, end, rho, rows, n, fields, seconds,
                        approaches[n], active,
                    )  # fmt: skip
            if has_box:
                if kind == box.KIND:
                    clearances[n] = _to_box(
                        position, velocity, begin, end, rho, rows, n, fields, seconds,
                        approaches[n], active,
                    )  # fmt: skip
            if has_cylinder:
                if kind == cylinder.KIND:
                    clearances[n] = _to_cylinder(
                        position, velocity, begin, end, rho, rows, n, fields, seconds,
                        approaches[n], active,
                    )  # fmt: skip
            if has_mesh:
                if kind == mesh_distance.KIND:
                    clearances[n] = _to_mesh(
                        position, velocity, begin, end, rho, rows, n, fields, seconds,
                        approaches[n], active,
                    )  # fmt: skip

    return search
