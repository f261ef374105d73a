"""Batches of substeps with contact of particles, and whether that was enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..grid import Array, Grid
from ..kernels.thread_pool import CHUNK
from ..state import State
from .contact_table import ContactTable
from .mesh_fields import MeshFields
from .particle_contact import BLOCK, IN_REACH, ROW, SHAPE, SUMS, TOTALS, TOUCHED
from .particle_search import compose_search
from .proximity import depth_of_particles, has_grown, triangles_cut
from .rigid_collider import GROWTH_SPEED, RigidCollider
from .shapes import mesh_distance
from .sheet_bounds import measure_triangles

# Least and greatest bound of the circumradius of triangles, as multiples of its value in the flat
# sheet.  What is larger still is left to the triangles.
_LEAST, _MOST = 1.05, 2.0
# Motion of particles, as a share of that bound, up to which triangles have not changed by much,
# and up to which the blocks in reach of a collider at rest need not be searched for again.
_UNCHANGED, _MARGIN = 0.02, 0.1
# Tables that are kept; a motion uses a few.
_MAX_TABLES = 16
# Depth of a triangle, as a multiple of the tolerance, from which on a batch was not enough.
_TOO_DEEP = 5.0
# Time, s, for which the size of triangles is predicted.  With twice that, sheets draped over a box
# did not come to rest: their surface trembled.  `cut` finds what has grown by more.
_PREDICTED = 1 / 240
# Depth, m, of a particle in the offset surface at which no triangle is deeper than is guaranteed.
LEFT = 8e-5


class Found(NamedTuple):
    """
    Blocks in reach of colliders at rest.

    Attributes
    ----------
    table
        As the kernel takes it.
    colliders, rows
        That it was made from.
    left
        How far particles may still move before it is out of date, m.

    """

    table: ContactTable
    colliders: tuple[RigidCollider, ...]
    rows: list[Array]
    left: float


class _Prepared(NamedTuple):
    """Arrays for batches with the same colliders; one batch is made at a time."""

    table: ContactTable
    at_end: ContactTable  # its last rows, and the blocks that are in reach at the end
    rows: list[Array]  # that the table was filled from
    active: Array  # blocks in reach in the batch or at its end


class ParticleBatch:
    """
    Makes tables for batches, and checks their outcome.

    Parameters
    ----------
    grid, dtype
        Of the sheet.
    rho
        Circumradius of the triangles of the flat sheet, m.
    gravity
        m/s².
    pinned
        Which particles are, bool, shape (rows, columns).
    colliders
        Of the scene.
    fields
        Of their meshes.

    Attributes
    ----------
    rho
        Bound of the circumradius of the triangles of each particle, m, shape (size,).
    elapsed, moved
        Time, s, since that was computed, and how far particles may have moved until the end of the
        present batch, m.
    excess
        By how much triangles were larger then, m.

    """

    def __init__(
        self,
        grid: Grid,
        dtype: type,
        rho: float,
        gravity: float,
        pinned: Array,
        colliders: Sequence[RigidCollider],
        fields: MeshFields,
    ) -> None:
        self._grid, self._dtype, self._fields = grid, dtype, fields
        self._layout = (grid.begin, grid.end, grid.stride)
        self._bounds = (_LEAST * rho, _MOST * rho)
        self._search = compose_search(frozenset([each.kind for each in colliders]))
        self._cells = grid.field(dtype, components=1)[0]
        self.rho: Array = grid.field(dtype, components=1)[0]
        self._mass: Array = grid.field(dtype, components=1)[0]
        self._free_masses = grid.tributary_areas * ~pinned
        grid.interior(self._mass)[...] = self._free_masses
        self._gravity, self._small = gravity, _UNCHANGED * _LEAST * rho
        self._found: Found | None = None
        self.invalidate()
        self._none: Array = np.zeros_like(self.rho)
        # Of each collider in a search: by how much it approaches the sheet, and the clearance, m.
        self._numbers = np.zeros((2, len(colliders)))
        self._cached: dict[tuple[Any, ...], _Prepared] = {}

    def hold(self, held: Array) -> None:
        """Let contact not move particles of these flat indices: grippers hold them."""
        self._grid.interior(self._mass)[...] = self._free_masses
        self._mass[held] = 0

    def invalidate(self) -> None:
        """Bound the triangles anew, and search for blocks in reach, at the next batch."""
        self.elapsed, self.moved, self.excess = 0.0, math.inf, 0.0
        self._found = None

    def known(self, state: State) -> tuple[tuple[str, ...], float]:
        """Return for which colliders blocks in reach are known, and for how much motion, m."""
        found = self._found
        if found is None or not self._is_valid(found, found.colliders, state):
            return (), 0.0
        return tuple([each.name for each in found.colliders]), found.left

    def search_again(self, state: State, colliders: Sequence[RigidCollider], left: float) -> None:
        """
        Find the blocks in reach of colliders at rest that were known in a restored state.

        So the next batches are made in the same way as without the restore.
        """
        self._found = None
        if not colliders:
            return
        rows = [each.rows(state.origin, np.zeros(2)) for each in colliders]
        table = self._prepare(colliders, rows).table
        approaches, clearances = self._numbers[:, : len(colliders)]
        approaches[:] = left + self.excess
        self._search(
            state.position, state.velocity, *self._layout[:2], 0.0, table, approaches, clearances
        )  # fmt: skip
        self._found = Found(table, tuple(colliders), rows, left)

    @staticmethod
    def _is_valid(found: Found, near: Sequence[RigidCollider], state: State) -> bool:
        """Return whether nothing has changed about the colliders: rows are the same objects."""
        if len(near) != len(found.rows):
            return False
        rows = zip(near, found.rows, strict=True)
        return all(each.row_at_rest(state.origin) is row for each, row in rows)

    def found(
        self, state: State, near: Sequence[RigidCollider], seconds: float, fastest: float
    ) -> ContactTable | None:
        """
        Return the table of the last batch if it holds for another one; see `table`.

        Then nothing moves by much: particles alone are enough, if `held` agrees after the batch.
        """
        found = self._found
        motion = 2 * seconds * fastest
        if found is None or not motion < min(found.left, self._small):
            return None
        if not self._is_valid(found, near, state):
            return None
        self._measure(state, seconds, motion)
        found.table.sums[...] = 0
        np.minimum(found.table.active, IN_REACH, out=found.table.active)
        return found.table

    def held(self, seconds: float, before: float, after: float) -> bool:
        """
        Return whether particles have moved as little in a batch as `found` has assumed.

        Parameters
        ----------
        seconds
            Length of the batch, s.
        before, after
            Speed of the fastest particle at its start and end, m/s.

        """
        found = self._found
        assert found is not None
        motion = 2 * seconds * max(before, after)
        if not motion < min(found.left, self._small):  # as for NaN
            return False
        self.moved += motion - 2 * seconds * before
        self._found = found._replace(left=found.left - motion)
        return True

    def table(
        self,
        state: State,
        near: Sequence[RigidCollider],
        times: Array,
        fastest: float,
    ) -> ContactTable:
        """
        Return what the kernel needs for a batch; its blocks are those in reach of a collider.

        Parameters
        ----------
        state
            At the start of the batch.
        near
            Colliders, whose clearances are set.
        times
            At the start and after each drift, s.
        fastest
            Speed of the fastest particle at the start, m/s.

        """
        seconds = float(times[-1] - times[0])
        margin = _MARGIN * self._bounds[0]
        rows = [each.rows(state.origin, times) for each in near]
        prepared = self._prepare(near, rows)
        approaches, clearances = self._numbers[:, : len(near)]
        for n, each in enumerate(near):
            motion = seconds * (each.surface_speed(state.origin) + GROWTH_SPEED * each.grows)
            approaches[n] = motion + margin + self.excess
        table = prepared.table
        table.sums[...] = 0
        self._search(
            state.position, state.velocity, *self._layout[:2], seconds, table, approaches,
            clearances,
        )  # fmt: skip
        for n, clearance in enumerate(clearances.tolist()):
            near[n].clearance = clearance - self.excess
        self._found = None
        if len(table.rows) == 1 and table.active.any():
            self._found = Found(table, tuple(near), rows, margin)
        return table

    def _speed(self, fastest: float, seconds: float) -> float:
        """Return a bound of the speed, m/s, in a batch: twice that at its start, and a fall."""
        return 2 * fastest + 0.5 * self._gravity * seconds

    def measure(self, state: State, seconds: float, fastest: float) -> None:
        """Bound the triangles for a motion of `seconds` from a greatest speed on, m/s."""
        self._measure(state, seconds, seconds * self._speed(fastest, seconds))

    def _measure(self, state: State, seconds: float, motion: float) -> None:
        """Bound the triangles anew, unless they cannot have changed by much."""
        self.elapsed += seconds
        self.moved += motion
        if self.moved < self._small:
            return
        self.excess = measure_triangles(
            state.position, state.velocity, *self._layout, self.elapsed,
            _PREDICTED, *self._bounds, self._cells, self.rho,
        )  # fmt: skip
        self.elapsed, self.moved = 0.0, motion

    def _prepare(self, near: Sequence[RigidCollider], rows: list[Array]) -> _Prepared:
        """Return arrays for these colliders, filled with their rows."""
        count = max([len(row) for row in rows])
        key = (*[each.kind for each in near], count)
        prepared = self._cached.get(key)
        if prepared is None:
            if len(self._cached) == _MAX_TABLES:
                self._cached.clear()
            prepared = self._cached[key] = self._empty(near, count)
        known = prepared.rows
        for n, row in enumerate(rows):
            if len(known) != len(rows) or row is not known[n]:
                prepared.table.rows[:, n] = row
                prepared.table.starts[n] = self._fields.starts[near[n].name]
        known[:] = rows
        return prepared

    def _empty(self, near: Sequence[RigidCollider], count: int) -> _Prepared:
        """Return arrays for these colliders, with so many rows of each."""
        number, particles = len(near), self._grid.end - self._grid.begin
        table = ContactTable(
            np.array([each.kind for each in near]),
            np.zeros((count, number, ROW), self._dtype),
            np.zeros((number, -(-particles // BLOCK)), np.int64),
            self.rho,
            self._mass,
            self._fields.values,
            self._fields.shares,
            np.zeros(number, np.int64),
            np.zeros((-(-particles // CHUNK), TOTALS), self._dtype),
            np.zeros((number, -(-particles // CHUNK), SUMS)),
        )
        at_end = table._replace(rows=table.rows[-1:], active=np.zeros_like(table.active))
        return _Prepared(table, at_end, [], np.zeros_like(table.active))

    def take(
        self, state: State, near: Sequence[RigidCollider], table: ContactTable
    ) -> list[RigidCollider]:
        """Add the sums of a batch to those of the colliders; return those that have touched."""
        totals = np.add.reduce(table.sums, axis=1).tolist()
        origin = state.origin.tolist()
        for n, each in enumerate(near):
            each.take(table.rows[-1, n], origin, totals[n])
        return [each for n, each in enumerate(near) if totals[n][TOUCHED]]

    def cut(
        self, state: State, near: Sequence[RigidCollider], table: ContactTable, time: float
    ) -> list[RigidCollider]:
        """
        Return the colliders that a triangle cuts: one has become too large, or was left inside.

        Parameters
        ----------
        state, time
            At the end of a batch, s.
        near, table
            Of the batch.

        """
        found = []
        prepared = self._cached[(*table.kinds.tolist(), len(table.rows))]
        end, active = prepared.at_end, prepared.active
        none, gaps = self._numbers[:, : len(near)]
        none[...] = 0
        # Blocks that a collider has reached, whether that was expected or not.
        self._search(
            state.position, state.velocity, *self._layout[:2], 0.0, end, none, gaps
        )  # fmt: skip
        np.maximum(table.active, end.active, out=active)
        grown = has_grown(state.position, *self._layout, table.rho, active, self._cells)
        for n, each in enumerate(near):
            # True for NaN.
            inside = not gaps[n] > -LEFT
            if inside:
                self._found = None
            if math.isinf(each.shape.inner_radius):
                # Alone, it moves all particles out that it may touch.
                if inside and (len(near) > 1 or (end.active[n] > table.active[n]).any()):
                    found.append(each)
                continue
            if not (grown or inside):
                continue
            row = each.rows(state.origin, np.array([time, time]), triangles=True)[0]
            if each.triangle_kind == mesh_distance.KIND:
                # The triangles between particles in the offset may come as near as the surface.
                row = row.copy()
                row[SHAPE + mesh_distance.MARGIN] = 0.0
            # Where a particle is inside of the offset surface, all triangles are looked at.
            if triangles_cut(
                state.position, *self._layout, self._none if inside else table.rho,
                active[n], self._cells, each.triangle_kind, row, self._fields.of(each),
                _TOO_DEEP * each.tolerance,
            ):  # fmt: skip
                found.append(each)
        return found

    def depth(self, collider: RigidCollider, state: State, *, offset: bool = True) -> float:
        """Return the greatest depth, m, of a particle in the offset or the true surface."""
        row = collider.rows(state.origin, np.zeros(2))[0]
        depth: float = depth_of_particles(
            state.position, *self._layout[:2], collider.kind, row, self._fields.of(collider),
            self._bounds[0] if offset else 0.0,
        )  # fmt: skip
        return depth

    def warm_up(self, colliders: Sequence[RigidCollider], state: State) -> ContactTable:
        """Compile the kernels; return a table of which nothing is in reach."""
        table = self._empty(colliders, 1).table
        self._measure(state, 0.0, math.inf)
        none = np.zeros(len(colliders))
        self._search(state.position, state.velocity, *self._layout[:2], 0.0, table, none, none)
        table.active[...] = 0
        has_grown(state.position, *self._layout, table.rho, table.active, self._cells)
        each = colliders[0]
        row = each.rows(state.origin, np.zeros(2), triangles=True)[0]
        triangles_cut(
            state.position, *self._layout, table.rho, table.active[0], self._cells,
            each.triangle_kind, row, self._fields.of(each), 1.0,
        )  # fmt: skip
        self.depth(each, state)
        return table
