"""Distances from all shapes, and parts of kernels that depend on the kind of a shape."""

from __future__ import annotations

from collections.abc import Callable, Set

from ...kernels.jit import Kernel, inlined
from . import box, capsule, cylinder, mesh_distance, plane, sphere
from .shape import Distance

DISTANCES: dict[int, Distance] = {
    shape.KIND: shape.distance for shape in (plane, sphere, capsule, box, cylinder, mesh_distance)
}


def _in_loop(distance: Distance) -> Kernel:
    """Return a distance as loops over particles take it."""

    @inlined
    def indexed(x, y, z, rotation, constants, rho, fields, _):  # type: ignore[no-untyped-def]
        return distance(x, y, z, rotation, constants, rho, fields)

    return indexed


# The same for loops over particles; these pass the number of a particle in the loop as well, for
# which `mesh_distance.in_tiles` has fetched the fields of a mesh.
IN_LOOPS: dict[int, Kernel] = {kind: _in_loop(each) for kind, each in DISTANCES.items()}
IN_LOOPS[mesh_distance.KIND] = mesh_distance.fetched_distance


def by_kind(kinds: Set[int], part: Callable[[int], Kernel]) -> Kernel:
    """
    Return a part of kernels for shapes of several kinds; it takes the kind before its arguments.

    Parameters
    ----------
    kinds
        Those that are compiled; a scene pays for no others.
    part
        Makes the part for one kind.

    """
    kind, *others = sorted(kinds)
    chosen = part(kind)
    if not others:

        @inlined
        def only(_, *arguments):  # type: ignore[no-untyped-def]
            return chosen(*arguments)

        return only
    rest = by_kind(set(others), part)

    @inlined
    def choose(wanted, *arguments):  # type: ignore[no-untyped-def]
        if wanted == kind:
            return chosen(*arguments)
        return rest(wanted, *arguments)

    return choose
