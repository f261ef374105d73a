"""Distances from all shapes, and parts of kernels that depend on the kind of a shape."""

from __future__ import annotations

from collections.abc import Callable, Set

from ...kernels.jit import Kernel, inlined
from . import box, capsule, cylinder, mesh_distance, plane, sphere
from .shape import Distance

DISTANCES: dict[int, Distance] = {
    shape.KIND: shape.distance for shape in (plane, sphere, capsule, box, cylinder, mesh_distance)
}


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
