"""Search for the particles that colliders may touch in a batch of substeps."""

from __future__ import annotations

import functools
from collections.abc import Set

import numpy as np

from ..grid import GHOST
from ..kernels.jit import Kernel, components, disjoint, kernel
from .minimum import least
from .particle_contact import BLOCK, IN_REACH, load_row
from .shapes.by_kind import DISTANCES, by_kind
from .shapes.shape import ONE, ZERO

# m; what is farther away is a ghost.
_FAR = 0.1 * GHOST


def _bound(kind: int) -> Kernel:
    """Return the part that bounds the gaps between a block and a shape."""
    distance = DISTANCES[kind]

    @disjoint
    def comes_near(  # type: ignore[no-untyped-def]
        first, position, velocity, rho, fields, point, rotation, inset, constants, h, approach,
        lowest,
    ):  # fmt: skip
        """
        Return whether a block comes into reach if it moves towards the shape for `h` s.

        Parameters
        ----------
        first, position, velocity
            Flat index of its first particle; positions and velocities as arrays of x, y and z.
        rho, fields
            See `ContactTable`.
        point, rotation, inset, constants
            Of the collider, see `particle_contact.load_row`.
        approach
            By how much the collider may move, m.
        lowest
            Least bound of a gap at each place in a block, m; decreased.

        """
        (xs, ys, zs), (us, vs, ws), (px, py, pz) = position, velocity, point
        zero, one, far = constants[ZERO], constants[ONE], lowest.dtype.type(_FAR)
        near = zero
        for lane in range(np.uint64(BLOCK)):
            i = first + lane
            x, y, z = xs[i] - px, ys[i] - py, zs[i] - pz
            gap, _, _, _ = distance(x, y, z, rotation, constants, rho[i], fields)
            u, v, w = us[i], vs[i], ws[i]
            gap += inset - h * np.sqrt(u * u + v * v + w * w)
            # Not of a ghost, which may be on either side of a plane.
            gap = gap if xs[i] < far else far
            near += zero if gap > approach else one
            lowest[lane] = gap if gap < lowest[lane] else lowest[lane]
        return near > zero

    return comes_near


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
    comes_near = by_kind(kinds, _bound)

    @kernel
    def search(position, velocity, begin, end, seconds, contacts, approaches, clearances):  # type: ignore[no-untyped-def]
        types, rows, active, rho, _, values, shares, starts, _, _ = contacts
        number = velocity.dtype.type
        far, h = number(_FAR), number(seconds)
        lowest = np.empty(BLOCK, velocity.dtype)
        position, velocity = components(position), components(velocity)
        for n in range(len(types)):
            rotation, point, _, _, limits, constants = load_row(rows, np.int64(0), n)
            fields = (values, shares, np.uint64(starts[n]))
            approach = number(approaches[n])
            lowest[:] = far
            for block in range(active.shape[1]):
                first = np.uint64(begin + block * BLOCK)
                near = comes_near(
                    types[n], first, position, velocity, rho, fields, point, rotation, limits[0],
                    constants, h, approach, lowest,
                )  # fmt: skip
                active[n, block] = IN_REACH if near else 0
            clearances[n] = least(lowest, far)

    return search
