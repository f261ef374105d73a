"""Colliders that are placed inside the sheet, at the start or by a change from outside."""

from __future__ import annotations

import math

from ..state import State
from .particle_batch import ParticleBatch
from .rigid_collider import RigidCollider
from .triangle_substep import TriangleSubstep

# Share of its inner radius by which a collider shrinks at most.
_SHRUNK = 0.999
# Depth, as a multiple of the tolerance, from which on a collider counts as inside.
_INSIDE = 5.0


def shrink_to_room(
    collider: RigidCollider,
    state: State,
    rho: float,
    particles: ParticleBatch,
    triangles: TriangleSubstep,
) -> None:
    """
    Shrink a collider that was placed to the room that a sheet leaves.

    Parameters
    ----------
    collider, state
        Of which the collider is changed.
    rho
        Circumradius of the triangles of the flat sheet, m.
    particles, triangles
        Find the depth.

    """
    collider.inset = collider.max_penetration = 0.0
    sheet = state.world_positions.reshape(3, -1)
    if not collider.reaches(sheet, rho):
        return
    depth = true = particles.depth(collider, state)
    if math.isfinite(collider.shape.inner_radius):
        true = triangles.depth(collider, state)
        # Only triangles meet a small one, and their offset surface would be far too wide.
        depth = true if collider.small else max(depth, true)
    if depth > _INSIDE * collider.tolerance:
        collider.inset = min(depth, _SHRUNK * collider.shape.inner_radius)
        left = true - collider.inset
        collider.max_penetration = left if left > 2 * collider.tolerance else 0.0
