"""How deep pins hold a sheet in colliders, which contact cannot change."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..grid import Array, Grid
from ..state import State
from .mesh_fields import MeshFields
from .particle_batch import ParticleBatch
from .rigid_collider import RigidCollider
from .triangle_contact import deepest_triangle

# Corners of the triangles of a cell, by both diagonals.
_CORNERS = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))


class DepthAtPins:
    """
    Finds the depth of the triangles with a pinned corner.

    Parameters
    ----------
    grid, fields
        Of the sheet, and of the meshes.
    particles
        Finds the depth in planes.
    pinned
        Which particles are, bool, shape (rows, columns).

    """

    def __init__(
        self, grid: Grid, fields: MeshFields, particles: ParticleBatch, pinned: Array
    ) -> None:
        self._fields, self._particles = fields, particles
        rows, columns = pinned.shape
        down, across = min(rows - 1, 1), min(columns - 1, 1)
        row, column = np.indices((max(rows - 1, 1), max(columns - 1, 1))).reshape(2, -1)
        first = row * columns + column
        corners = np.stack([first + r * columns + c for r in (0, down) for c in (0, across)], 1)
        triangles = corners[:, _CORNERS].reshape(-1, 3)
        triangles = triangles[pinned.ravel()[triangles].any(axis=1)]
        found, local = np.unique(triangles, return_inverse=True)
        flat = grid.begin + found // columns * grid.stride + found % columns
        # As `BroadPhase.find` returns them.
        self._triangles = (flat.astype(np.int32), local.reshape(-1, 3).astype(np.int64))

    def note(self, state: State, near: Sequence[RigidCollider]) -> None:
        """Increase the greatest depth that is known of colliders near the sheet."""
        if not len(self._triangles[0]):
            return
        for each in near:
            if each.clearance > 0:
                continue
            if math.isinf(each.shape.inner_radius):
                depth = self._particles.depth(each, state, offset=False)
            else:
                depth = self._depth(each, state)
            if depth > max(2 * each.tolerance, each.max_penetration):
                each.max_penetration = depth

    def _depth(self, collider: RigidCollider, state: State) -> float:
        row = collider.rows(state.origin, np.zeros(2), triangles=True)[0]
        depth: float = deepest_triangle(
            state.position, state.velocity, state.contact_mobility, *self._triangles,
            collider.triangle_kind, row, self._fields.of(collider), collider.triangle_radii[0],
            collider.tolerance,
        )  # fmt: skip
        return depth
