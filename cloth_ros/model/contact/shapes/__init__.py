"""Shapes of colliders: each a signed distance for the kernels, and its lengths."""

from __future__ import annotations

from collections.abc import Callable

from ....scene.collider import ColliderParameters
from . import box, capsule, cylinder, plane, sphere
from .shape import Shape

# How to make each type.  A new shape is one more entry, and a branch in `particle_contact`.
_MAKERS: dict[str, Callable[[ColliderParameters], Shape]] = {
    'plane': lambda _: plane.plane(),
    'sphere': lambda it: sphere.sphere(it.radius),
    'capsule': lambda it: capsule.capsule(it.radius, it.length),
    'box': lambda it: box.box(it.size),
    'cylinder': lambda it: cylinder.cylinder(it.radius, it.length),
}


def shape_of(parameters: ColliderParameters) -> Shape:
    """Return the shape of a collider."""
    return _MAKERS[parameters.type](parameters)
