"""Substeps with contact of triangles: colliders that are small, or too fast for particles."""

from __future__ import annotations

from collections.abc import Set

import numpy as np

from ..grid import Array, Grid
from ..state import State
from .broad_phase import BroadPhase
from .mesh_fields import MeshFields
from .particle_contact import POINT, SPIN, SUMS, TOUCHED
from .rigid_collider import RigidCollider
from .triangle_contact import deepest_triangle, push_out_triangles, resolve_triangles

# Least share of its inner radius that a collider keeps while it grows.
_LEAST = 0.1
# Share of its inner radius to which a collider shrinks at most, where it is given no room.
_SHRUNK = 0.99


class TriangleSubstep:
    """
    Moves triangles and colliders through substeps.

    Parameters
    ----------
    grid
        Of the sheet.
    fields
        Of the meshes.
    gravity
        m/s², shape (3,).

    """

    def __init__(self, grid: Grid, fields: MeshFields, gravity: Array) -> None:
        self._grid, self._fields, self._gravity = grid, fields, gravity
        self._broad_phases: dict[str, BroadPhase] = {}

    def invalidate(self) -> None:
        """Discard candidates: sheet or colliders were placed from outside."""
        for each in self._broad_phases.values():
            each.invalidate()

    def follow(self, names: Set[str]) -> None:
        """Discard candidates of all colliders but these, whose motion is not followed now."""
        for name, each in self._broad_phases.items():
            if name not in names:
                each.invalidate()

    def resolve(
        self, collider: RigidCollider, state: State, times: Array, fastest: float
    ) -> tuple[bool, bool, float]:
        """
        Resolve the contact with a collider of a state that has drifted.

        Parameters
        ----------
        collider
            The collider.
        state
            After the drift; changed.
        times
            Before and after it, s.
        fastest
            Speed of the fastest particle before or after it, m/s.

        Returns
        -------
        (bool, bool, float)
            Whether there was contact; whether it had to move particles otherwise than by
            impulses; and how far it has moved one from where it had drifted to, m.

        """
        if collider.name not in self._broad_phases:
            self._broad_phases[collider.name] = BroadPhase(self._grid)
        broad_phase = self._broad_phases[collider.name]
        h = float(times[1] - times[0])
        before = collider.rows(state.origin, times[[0, 0]], triangles=True)[0]
        after = collider.rows(state.origin, times, triangles=True)[0]
        outer, inner = collider.triangle_radii
        approach = h * (fastest + collider.surface_speed(state.origin))
        broad_phase.reduce_clearance(approach)
        collider.max_penetration = 0.0
        collider.touching = 0
        collider.clearance = broad_phase.clearance
        if broad_phase.clearance > 0:
            return False, False, 0.0
        particles, triangles = broad_phase.find(
            state, h, before[POINT:SPIN], after[POINT:SPIN], outer, approach
        )
        collider.clearance = broad_phase.clearance
        if not len(particles):
            return False, False, 0.0
        sums = np.zeros(SUMS)
        inner = max(inner - collider.inset, _LEAST * inner)
        depth, unheld, touched, forced, farthest = resolve_triangles(
            state.position, state.velocity, state.contact_mobility, particles, triangles, h,
            self._gravity, collider.triangle_kind, before, after, self._fields.of(collider),
            outer, inner, collider.tolerance, sums,
        )  # fmt: skip
        collider.max_penetration = depth
        if touched:
            for each in self._broad_phases.values():
                each.reduce_clearance(farthest)
            collider.clearance -= farthest
        if forced and unheld > 0.0:
            # Particles are too fast to be pushed out: the collider shrinks to the room there is.
            self.shrink(collider, unheld)
            collider.max_penetration = depth - unheld
        collider.take(after, state.origin.tolist(), sums.tolist())
        return bool(sums[TOUCHED]), forced, farthest

    def push_out(self, collider: RigidCollider, state: State, time: float) -> tuple[float, float]:
        """
        Move triangles out of a collider without velocity.

        Return the greatest depth, m, or 0; and what is left that no pins hold.

        Parameters
        ----------
        collider, state
            The collider, and the state, which is changed.
        time
            At which both are, s.

        """
        row = collider.rows(state.origin, np.array([time, time]), triangles=True)[0]
        particles, triangles = self._all_near(collider, state, row)
        if not len(particles):
            return 0.0, 0.0
        sums = np.zeros(SUMS)
        outer, inner = collider.triangle_radii
        inner = max(inner - collider.inset, _LEAST * inner)
        depth, left = push_out_triangles(
            state.position, state.velocity, state.contact_mobility, particles, triangles,
            self._gravity, collider.triangle_kind, row, self._fields.of(collider), outer, inner,
            collider.tolerance, sums,
        )  # fmt: skip
        if depth > 0:  # what the broad phases know is out of date
            self.invalidate()
        return depth, left

    def shrink(self, collider: RigidCollider, depth: float) -> None:
        """Shrink a collider by a depth, m, out of which the sheet could not be moved."""
        collider.inset = min(collider.inset + depth, _SHRUNK * collider.shape.inner_radius)

    def _all_near(self, collider: RigidCollider, state: State, row: Array) -> tuple[Array, Array]:
        """Return the particles in reach of a collider, and their triangles."""
        outer, centre = collider.triangle_radii[0], row[POINT:SPIN]
        return BroadPhase(self._grid).find(state, 0.0, centre, centre, outer, 0.0)

    def depth(self, collider: RigidCollider, state: State) -> float:
        """Return the greatest depth of a triangle in a collider, m, or 0."""
        row = collider.rows(state.origin, np.zeros(2), triangles=True)[0]
        particles, triangles = self._all_near(collider, state, row)
        if not len(particles):
            return 0.0
        outer = collider.triangle_radii[0]
        depth: float = deepest_triangle(
            state.position, state.velocity, state.contact_mobility, particles, triangles,
            collider.triangle_kind, row, self._fields.of(collider), outer, collider.tolerance,
        )  # fmt: skip
        return depth

    def warm_up(self, collider: RigidCollider, state: State) -> None:
        """Compile the kernels."""
        row = collider.rows(state.origin, np.zeros(2), triangles=True)[0]
        centre = row[POINT:SPIN]
        BroadPhase(self._grid).find(state, 0.0, centre, centre, 1e9, 0.0)
        none, triangles = np.zeros(0, np.int32), np.zeros((0, 3), np.int64)
        sheet, fields = (
            (state.position, state.velocity, state.contact_mobility),
            self._fields.of(collider),
        )
        resolve_triangles(
            *sheet, none, triangles, 0.0, self._gravity, collider.triangle_kind, row, row, fields,
            1.0, 1.0, 1e-5, np.zeros(SUMS),
        )  # fmt: skip
        deepest_triangle(*sheet, none, triangles, collider.triangle_kind, row, fields, 1.0, 1e-5)
        push_out_triangles(
            *sheet, none, triangles, self._gravity, collider.triangle_kind, row, fields, 1.0, 1.0,
            1e-5, np.zeros(SUMS),
        )  # fmt: skip
