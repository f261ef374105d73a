"""Shapes of colliders: each a signed distance for the kernels, and its lengths."""

from __future__ import annotations

from collections.abc import Callable

from ....scene.collider import ColliderParameters
from . import box, capsule, cylinder, mesh_shape, plane, sphere
from .shape import Shape

# How to make each type, for triangles of a circumradius.  A new shape is one more entry, and a
# branch in `particle_contact` and in `distance`.
_MAKERS: dict[str, Callable[[ColliderParameters, float], Shape]] = {
    'plane': lambda _, rho: plane.plane(),
    'sphere': lambda it, rho: sphere.sphere(it.radius),
    'capsule': lambda it, rho: capsule.capsule(it.radius, it.length),
    'box': lambda it, rho: box.box(it.size),
    'cylinder': lambda it, rho: cylinder.cylinder(it.radius, it.length),
    'mesh': lambda it, rho: mesh_shape.mesh_shape(f'collider.{it.name}.mesh', it.mesh, rho),
}


def shape_of(parameters: ColliderParameters, rho: float) -> Shape:
    """
    Return the shape of a collider.

    Parameters
    ----------
    parameters
        Of the collider.
    rho
        Circumradius of the triangles of the undeformed sheet, m.

    Raises
    ------
    ValueError
        A mesh cannot be used.

    """
    return _MAKERS[parameters.type](parameters, rho)
