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
    def loop(first, last, position, velocity, rho, rows, n, fields, seconds):  # type: ignore[no-untyped-def]
        """Return the least gap, m, that is left after so many s if all move towards the shape."""
        number = velocity.dtype.type
        rotation, point, _, _, others, constants = load_row(rows, np.int64(0), n)
        px, py, pz = point
        inset, h, far = others[0], number(seconds), number(0.1 * GHOST)
        nearest = far
        for i in range(first, last):
            x, y, z = position[0, i] - px, position[1, i] - py, position[2, i] - pz
            gap, _, _, _ = distance(x, y, z, rotation, constants, rho[i], fields)
            u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
            gap += inset - h * np.sqrt(u * u + v * v + w * w)
            # Not of a ghost, which may be on either side of a plane.
            gap = gap if position[0, i] < far else far
            # False for NaN.
            nearest = gap if gap < nearest else nearest
        return nearest

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
            clearance = np.inf
            for block in range(active.shape[1]):
                first = np.uint64(begin + block * BLOCK)
                last = np.uint64(min(begin + (block + 1) * BLOCK, end))
                gap = position[0, first]
                if has_plane:
                    if kind == plane.KIND:
                        gap = _to_plane(
                            first, last, position, velocity, rho, rows, n, fields, seconds
                        )
                if has_sphere:
                    if kind == sphere.KIND:
                        gap = _to_sphere(
                            first, last, position, velocity, rho, rows, n, fields, seconds
                        )
                if has_capsule:
                    if kind == capsule.KIND:
                        gap = _to_capsule(
                            first, last, position, velocity, rho, rows, n, fields, seconds
                        )
                if has_box:
                    if kind == box.KIND:
                        gap = _to_box(
                            first, last, position, velocity, rho, rows, n, fields, seconds
                        )
                if has_cylinder:
                    if kind == cylinder.KIND:
                        gap = _to_cylinder(
                            first, last, position, velocity, rho, rows, n, fields, seconds
                        )
                if has_mesh:
                    if kind == mesh_distance.KIND:
                        gap = _to_mesh(
                            first, last, position, velocity, rho, rows, n, fields, seconds
                        )
                clearance = min(clearance, gap)
                # True for NaN.
                active[n, block] = 0 if gap > approaches[n] else 1
            clearances[n] = clearance

    return search
