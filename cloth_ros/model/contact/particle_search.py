"""Search for the particles that colliders may touch in a batch of substeps."""

from __future__ import annotations

import functools
from collections.abc import Set

import numpy as np

from ..grid import GHOST
from ..kernels.jit import Kernel, inlined, kernel
from .minimum import least
from .particle_contact import BLOCK, load_row
from .shapes import mesh_distance
from .shapes.by_kind import IN_LOOPS, by_kind

# m; what is farther away is a ghost.
_FAR = 0.1 * GHOST


def _gap_loop(kind: int) -> Kernel:
    """Return the loop that computes the gaps between particles and one shape."""
    distance = IN_LOOPS[kind]

    @inlined
    def loop(first, last, fields, position, velocity, begin, rho, rows, n, h, gaps):  # type: ignore[no-untyped-def]
        """Write what is left of the gaps if particles move towards the shape for `h` s, m."""
        rotation, point, _, _, others, constants = load_row(rows, np.int64(0), n)
        px, py, pz = point
        inset, far = others[0], gaps.dtype.type(_FAR)
        for i in range(first, last):
            x, y, z = position[0, i] - px, position[1, i] - py, position[2, i] - pz
            gap, _, _, _ = distance(x, y, z, rotation, constants, rho[i], fields, i - first)
            u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
            gap += inset - h * np.sqrt(u * u + v * v + w * w)
            # Not of a ghost, which may be on either side of a plane.
            gaps[i - begin] = gap if position[0, i] < far else far

    if kind != mesh_distance.KIND:
        return loop
    tiles = mesh_distance.in_tiles(loop)

    @inlined
    def tiled(first, last, fields, position, velocity, begin, rho, rows, n, h, gaps):  # type: ignore[no-untyped-def]
        rotation, point, _, _, _, constants = load_row(rows, np.int64(0), n)
        arguments = (position, velocity, begin, rho, rows, n, h, gaps)
        tiles(first, last, position, point, rotation, constants, fields, arguments)

    return tiled


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
    write_gaps = by_kind(kinds, _gap_loop)

    @kernel
    def search(position, velocity, begin, end, seconds, contacts, approaches, clearances):  # type: ignore[no-untyped-def]
        types, rows, active, rho, _, values, shares, starts, _ = contacts
        number = velocity.dtype.type
        far = number(_FAR)
        gaps = np.empty(end - begin, velocity.dtype)
        first, last = np.uint64(begin), np.uint64(end)
        for n in range(len(types)):
            fields = (values, shares, np.uint64(starts[n]))
            write_gaps(
                types[n], first, last, fields, position, velocity, first, rho, rows, n,
                number(seconds), gaps,
            )  # fmt: skip
            clearance = far
            for block in range(active.shape[1]):
                nearest = least(gaps, block * BLOCK, far)
                active[n, block] = 0 if nearest > approaches[n] else 1
                clearance = min(clearance, nearest)
            clearances[n] = clearance

    return search
