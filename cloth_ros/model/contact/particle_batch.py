"""Batches of substeps with contact of particles, and whether that was enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..grid import Array, Grid
from ..kernels.thread_pool import CHUNK
from ..state import State
from .contact_table import ContactTable
from .mesh_fields import MeshFields
from .particle_contact import BLOCK, ROW, SUMS, compose_search
from .proximity import depth_of_particles, has_grown, large_triangles_cut
from .rigid_collider import RigidCollider
from .sheet_bounds import measure_triangles

# Least and greatest bound of the circumradius of triangles, as multiples of its value in the flat
# sheet.  What is larger still is left to the triangles.
_LEAST, _MOST = 1.05, 2.0
# Tables that are kept; a motion uses a few.
_MAX_TABLES = 16
# Depth of a triangle, as a multiple of the tolerance, from which on a batch was not enough.
_TOO_DEEP = 5.0


class ParticleBatch:
    """
    Makes tables for batches, and checks their outcome.

    Parameters
    ----------
    grid, dtype
        Of the sheet.
    rho
        Circumradius of the triangles of the flat sheet, m.
    colliders
        Of the scene.
    fields
        Of their meshes.

    Attributes
    ----------
    rho
        Bound of the circumradius of the triangles of each particle, m, shape (size,).

    """

    def __init__(
        self,
        grid: Grid,
        dtype: type,
        rho: float,
        colliders: Sequence[RigidCollider],
        fields: MeshFields,
    ) -> None:
        self._grid, self._dtype, self._fields = grid, dtype, fields
        self._layout = (grid.begin, grid.end, grid.stride)
        self._bounds = (_LEAST * rho, _MOST * rho)
        self._search = compose_search(frozenset([each.kind for each in colliders]))
        self._cells = grid.field(dtype, components=1)[0]
        self.rho: Array = grid.field(dtype, components=1)[0]
        self._cached: dict[tuple[Any, ...], ContactTable] = {}

    def table(
        self,
        state: State,
        near: Sequence[RigidCollider],
        times: Array,
        approaches: Sequence[float],
    ) -> ContactTable | None:
        """
        Return what the kernel needs for a batch; None if all colliders are out of reach.

        Parameters
        ----------
        state
            At the start of the batch.
        near
            Colliders, whose clearances are set.
        times
            At the start and after each drift, s.
        approaches
            By how much the surface of each may move in the batch, m.

        """
        seconds = float(times[-1] - times[0])
        self._measure(state, seconds)
        rows = [each.rows(state.origin, times) for each in near]
        count = max([len(row) for row in rows])
        table = self._empty(tuple([each.kind for each in near]), count)
        for n, row in enumerate(rows):
            table.rows[:, n] = row
            table.starts[n] = self._fields.starts[near[n].name]
        table.sums[...] = 0
        clearances = np.empty(len(near))
        self._search(
            state.position, state.velocity, *self._layout[:2], seconds, table,
            np.array(approaches), clearances,
        )  # fmt: skip
        for n, clearance in enumerate(clearances.tolist()):
            near[n].clearance = clearance
        return table if table.active.any() else None

    def _measure(self, state: State, seconds: float) -> None:
        measure_triangles(
            state.position, state.velocity, *self._layout, seconds, *self._bounds, self._cells,
            self.rho,
        )  # fmt: skip

    def _empty(self, kinds: tuple[int, ...], count: int) -> ContactTable:
        """Return a table for colliders of these kinds and so many rows; one is used at a time."""
        table = self._cached.get((kinds, count))
        if table is None:
            number, particles = len(kinds), self._grid.end - self._grid.begin
            table = ContactTable(
                np.array(kinds),
                np.zeros((count, number, ROW), self._dtype),
                np.zeros((number, -(-particles // BLOCK)), np.int64),
                self.rho,
                self._fields.values,
                self._fields.shares,
                np.zeros(number, np.int64),
                np.zeros((number, -(-particles // CHUNK), SUMS)),
            )
            if len(self._cached) == _MAX_TABLES:
                self._cached.clear()
            self._cached[kinds, count] = table
        return table

    def is_enough(
        self, state: State, near: Sequence[RigidCollider], table: ContactTable, time: float
    ) -> bool:
        """
        Return whether no triangle has become so large that it cuts a collider.

        Parameters
        ----------
        state, time
            At the end of a batch, s.
        near, table
            Of the batch.

        """
        if not has_grown(state.position, *self._layout, table.rho, table.active, self._cells):
            return True
        for n, each in enumerate(near):
            if math.isinf(each.shape.inner_radius):
                continue
            row = each.rows(state.origin, np.array([time, time]), triangles=True)[0]
            if large_triangles_cut(
                state.position, *self._layout, table.rho, table.active[n], self._cells,
                each.triangle_kind, row, self._fields.of(each), _TOO_DEEP * each.tolerance,
            ):  # fmt: skip
                return False
        return True

    def depth(self, collider: RigidCollider, state: State) -> float:
        """Return the greatest depth, m, of a particle in the offset surface; negative outside."""
        row = collider.rows(state.origin, np.zeros(2))[0]
        depth: float = depth_of_particles(
            state.position, *self._layout[:2], collider.kind, row, self._fields.of(collider),
            self._bounds[0],
        )  # fmt: skip
        return depth

    def warm_up(self, colliders: Sequence[RigidCollider], state: State) -> ContactTable:
        """Compile the kernels; return a table of which nothing is in reach."""
        table = self._empty(tuple([each.kind for each in colliders]), 1)
        self._measure(state, 0.0)
        none = np.zeros(len(colliders))
        self._search(state.position, state.velocity, *self._layout[:2], 0.0, table, none, none)
        table.active[...] = 0
        has_grown(state.position, *self._layout, table.rho, table.active, self._cells)
        each = colliders[0]
        row = each.rows(state.origin, np.zeros(2), triangles=True)[0]
        large_triangles_cut(
            state.position, *self._layout, table.rho, table.active[0], self._cells,
            each.triangle_kind, row, self._fields.of(each), 1.0,
        )  # fmt: skip
        self.depth(each, state)
        return table
