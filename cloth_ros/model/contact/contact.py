"""
Contact of the sheet with all colliders of a scene.

A batch of substeps takes the cheapest of these ways that is good enough:

1. A collider that is too far away to be reached has its clearance counted down.
2. Particles near a collider are kept out of its offset surface within the kernel of kicks and
   drifts (`particle_contact`), as long as that keeps the triangles between them out too: the
   collider is not small beside them, it and the sheet do not come near to passing through each
   other within a substep, and at the end of the batch no triangle is larger than was expected.
3. Otherwise the batch is made substep by substep, and triangles are moved through each of them
   together with the collider (`triangle_contact`).

A collider that is placed inside the sheet, at the start or by a change from outside, would eject
it at once.  It therefore starts as far inside its surface as there is room, and grows at `GROWTH_SPEED`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...scene import Scene
from ..grid import Array, Grid
from ..inputs import Inputs, Vector
from ..kernels.thread_pool import CHUNK
from ..state import State, max_speed
from .broad_phase import BroadPhase
from .contact_table import ContactTable, no_contacts
from .particle_contact import BLOCK, ROW, SUMS, TOUCHED, compose_search
from .proximity import depth_of_particles, has_grown, large_triangles_cut
from .rigid_collider import GROWTH_SPEED, ColliderSnapshot, RigidCollider
from .sheet_bounds import measure_triangles
from .triangle_contact import deepest_triangle, resolve_triangles

# A collider is small, if its blunt radius is below so many circumradii of the triangles.
_SMALL = 1.5
# Share of its inner radius by which collider and sheet may approach each other in a substep.
_TRAVEL = 0.5
# Least bound of the circumradius of triangles, as a multiple of its value in the flat sheet.
_LEAST = 1.05
# The same, at most: what is larger still is left to the triangles.
_MOST = 2.0
# Tables that are kept; a motion uses a few.
_MAX_TABLES = 16
# Batches that are made substep by substep after one that had to be repeated.
_PATIENCE = 4
# Depth, as a multiple of the tolerance, from which on a collider counts as placed inside the
# sheet, and a triangle as too deep.
_INSIDE = 5.0


class ContactSnapshot(NamedTuple):
    """Everything about contact that later results depend on; see `Contact`."""

    colliders: Mapping[str, ColliderSnapshot]
    patience: int
    rho: Array


class Observer(Protocol):
    """Receives every step, before and after contact."""

    def after_drift(self, state: State, step: Any, air_velocity: Vector) -> None:
        """Receive the state after a kick and a drift, before contact."""
        ...

    def after_contact(self, state: State, step: Any) -> None:
        """Receive the state after contact."""
        ...


class Kicks(Protocol):
    """Kicks and drifts of a scene, as far as contact is concerned."""

    def apply(
        self,
        state: State,
        steps: tuple[Any, ...],
        air_velocity: Vector,
        contacts: ContactTable | None = None,
    ) -> None:
        """Make the kicks and drifts of `steps`, with contact if any."""
        ...

    def resolve_contact(self, state: State, h: float, contacts: ContactTable) -> None:
        """Resolve the contact of a state that has just drifted for `h` s."""
        ...

    def take_work(self) -> float:
        """Return the work of the air since the last call, J."""
        ...


class Drift(Protocol):
    """A step of an integrator, as far as contact is concerned."""

    @property
    def drift(self) -> float:
        """Duration of the drift, s."""
        ...


class Contact:
    """
    Contact of a sheet with the colliders of a scene.

    Parameters
    ----------
    scene, grid
        Colliders, and the sheet that they touch.
    dtype
        numpy.float32 or numpy.float64.

    Attributes
    ----------
    colliders
        By name.
    touched
        True if one has touched the sheet since the last `take_work`.

    """

    def __init__(self, scene: Scene, grid: Grid, dtype: type) -> None:
        sheet = scene.sheet
        extent = 2 * sheet.diagonal or 1.0
        self._rho0 = 0.5 * math.hypot(*sheet.spacing)
        self.colliders = {
            each.name: RigidCollider(each, self._rho0, extent, dtype)
            for each in scene.all_colliders()
        }
        self.touched = False
        self._grid, self._dtype = grid, dtype
        self._cell_mass, self._gravity = sheet.cell_mass, np.array(scene.gravity)
        self._extent = extent
        self._cached: dict[tuple[Any, ...], ContactTable] = {}
        self._cells = grid.field(dtype, components=1)[0]
        self._rho = grid.field(dtype, components=1)[0]
        self._chunks = (grid.end - grid.begin + CHUNK - 1) // CHUNK
        self._blocks = (grid.end - grid.begin + BLOCK - 1) // BLOCK
        self._search = compose_search(self.kinds)
        self._broad_phases: dict[str, BroadPhase] = {}
        self._near: list[RigidCollider] = []
        self._fastest = 0.0
        self._patience = 0
        self._unknown = False
        self._fields, self._starts = _fields_of(self.colliders.values(), dtype)
        self._idle = no_contacts(dtype)

    @property
    def kinds(self) -> frozenset[int]:
        """Kinds of shapes that the kernels must know."""
        return frozenset(each.kind for each in self.colliders.values())

    # An advance

    def begin_advance(self, state: State, time: float, seconds: float, inputs: Inputs) -> None:
        """Start on the paths that are commanded for an advance of `seconds` from `time`, s."""
        for each in self.colliders.values():
            if not each.begin_advance(time, seconds, inputs):
                each.placed = True
                self._fit(each, state)

    def end_advance(self) -> None:
        """Place the colliders at the ends of their paths."""
        for each in self.colliders.values():
            each.end_advance()

    def may_act(self, state: State, seconds: float) -> bool:
        """
        Return False if no collider can reach the sheet within `seconds`.

        Not even if the sheet becomes twice as fast in that time; `pass_by` checks that afterwards.
        """
        self._fastest = max_speed(state)
        self._near = [
            each
            for each in self.colliders.values()
            # True for NaN.
            if each.grows or not each.clearance > seconds * self._approach(each, state, 2.0)
        ]
        return bool(self._near)

    def _approach(self, collider: RigidCollider, state: State, factor: float = 1.0) -> float:
        """Return a bound of the speed, m/s, at which collider and sheet approach each other."""
        return factor * self._fastest + self._surface_speed(collider, state)

    def _surface_speed(self, collider: RigidCollider, state: State) -> float:
        """Return a bound of the speed, m/s, of a collider where it may touch the sheet."""
        if not collider.path.moves:
            return 0.0
        away = float(np.linalg.norm(state.origin - collider.pose[:3]))
        return collider.surface_speed(away + 3 * self._extent)

    def pass_by(self, state: State, time: float, seconds: float) -> None:
        """Account for a motion of `seconds` from `time`, s, in which no collider was in reach."""
        self._fastest = max(self._fastest, max_speed(state))
        for each in self.colliders.values():
            each.clearance -= seconds * self._approach(each, state)
            each.move_to(time + seconds)

    def act(
        self,
        kicks: Kicks,
        state: State,
        steps: Sequence[Drift],
        air_velocity: Vector,
        time: float,
        observer: Observer | None,
    ) -> None:
        """
        Make the kicks and drifts of a batch, with contact.

        Parameters
        ----------
        kicks
            Of the scene.
        state
            At the start of the batch; changed.
        steps
            Of the batch.
        air_velocity
            m/s.
        time
            At the start, s.
        observer
            Receives every step, or None.

        """
        seconds = sum(step.drift for step in steps)
        longest = max(step.drift for step in steps)
        by_triangles = {each.name for each in self._near if self._is_sharp(each, state, longest)}
        if observer is None and not by_triangles and not self._patience:
            if self._act_on_particles(kicks, state, steps, air_velocity, time):
                for each in self._near:
                    each.grow(seconds)
                self._end_batch(state, time, seconds)
                return
            self._patience = _PATIENCE
        careful = self._patience > 0
        self._patience = max(self._patience - 1, 0)
        for broad_phase in self._broad_phases.values():  # its order must not depend on the past
            broad_phase.invalidate()
        for step in steps:
            kicks.apply(state, (step,), air_velocity, self._idle)
            if observer is not None:
                observer.after_drift(state, step, air_velocity)
            self._resolve_substep(kicks, state, time, step.drift, by_triangles, careful)
            time += step.drift
            if observer is not None:
                observer.after_contact(state, step)
        self._end_batch(state, time - seconds, seconds)

    def _is_sharp(self, collider: RigidCollider, state: State, h: float) -> bool:
        """Return whether particles alone cannot keep the triangles out of a collider."""
        shape = collider.shape
        if math.isinf(shape.inner_radius):  # of a plane they always can
            return False
        travel = h * self._approach(collider, state)
        if collider.inset > 0.5 * shape.inner_radius:
            return True
        # True for NaN.
        return (
            shape.blunt_radius < _SMALL * self._rho0 or not travel < _TRAVEL * shape.inner_radius
        )

    def _end_batch(self, state: State, time: float, seconds: float) -> None:
        self._fastest = max(self._fastest, max_speed(state))
        for each in self.colliders.values():
            each.clearance -= seconds * self._approach(each, state)
            each.move_to(time + seconds)

    # By particles

    def _act_on_particles(
        self,
        kicks: Kicks,
        state: State,
        steps: Sequence[Drift],
        air_velocity: Vector,
        time: float,
    ) -> bool:
        """Make a batch with contact of particles; return False, and undo it, if not good enough."""
        times = time + np.concatenate([[0.0], np.cumsum([step.drift for step in steps])])
        table = self._table(state, self._near, times)
        if table is None:
            kicks.apply(state, tuple(steps), air_velocity)
            return True
        blunt = [math.isfinite(each.shape.inner_radius) for each in self._near]
        before = (state.position.copy(), state.velocity.copy()) if any(blunt) else None
        kicks.apply(state, tuple(steps), air_velocity, table)
        if before is not None and not self._is_good(state, table, times):
            state.position[...], state.velocity[...] = before
            kicks.take_work()
            return False
        self._take(state, self._near, table)
        return True

    def _table(
        self, state: State, near: Sequence[RigidCollider], times: Array
    ) -> ContactTable | None:
        """Return what the kernel needs for these colliders; None if all are out of reach."""
        grid, seconds = self._grid, float(times[-1] - times[0])
        measure_triangles(
            state.position, state.velocity, grid.begin, grid.end, grid.stride, seconds,
            _LEAST * self._rho0, _MOST * self._rho0, self._cells, self._rho,
        )  # fmt: skip
        rows = [each.rows(state.origin, times) for each in near]
        table = self._tables(tuple(each.kind for each in near), max(map(len, rows)))
        for n, row in enumerate(rows):
            table.rows[:, n] = row
            table.starts[n] = self._starts[near[n].name]
        table.sums[...] = 0
        moved = [
            seconds * (self._surface_speed(each, state) + GROWTH_SPEED * each.grows)
            for each in near
        ]
        clearances = np.empty(len(near))
        self._search(
            state.position, state.velocity, grid.begin, grid.end, seconds, table,
            np.array(moved), clearances,
        )  # fmt: skip
        for each, clearance in zip(near, clearances.tolist(), strict=True):
            each.clearance = clearance
        return table if table.active.any() else None

    def _tables(self, kinds: tuple[int, ...], count: int) -> ContactTable:
        """Return a table for colliders of these kinds and so many rows; one is used at a time."""
        key = (kinds, count)
        table = self._cached.get(key)
        if table is None:
            number = len(kinds)
            table = ContactTable(
                np.array(kinds),
                np.zeros((count, number, ROW), self._dtype),
                np.zeros((number, self._blocks), np.int64),
                self._rho,
                *self._fields,
                np.zeros(number, np.int64),
                np.zeros((number, self._chunks, SUMS)),
            )
            if len(self._cached) == _MAX_TABLES:
                self._cached.clear()
            self._cached[key] = table
        return table

    def _is_good(self, state: State, table: ContactTable, times: Array) -> bool:
        """Return whether no triangle has become so large that it cuts a collider."""
        grid = self._grid
        layout = (grid.begin, grid.end, grid.stride)
        if not has_grown(state.position, *layout, table.rho, table.active, self._cells):
            return True
        for n, each in enumerate(self._near):
            if math.isfinite(each.shape.inner_radius):
                row = each.rows(state.origin, times[[-1, -1]], triangles=True)[0]
                if large_triangles_cut(
                    state.position, *layout, table.rho, table.active[n], self._cells,
                    each.triangle_kind, row, self._fields_of(each),
                    _INSIDE * each.tolerance,
                ):  # fmt: skip
                    return False
        return True

    def _take(self, state: State, near: Sequence[RigidCollider], table: ContactTable) -> None:
        total = table.sums.sum(axis=1)
        for n, each in enumerate(near):
            each.take(table.rows[-1, n], state.origin, total[n])
            if total[n, TOUCHED]:
                self.touched = True
                self._unknown = self._unknown or each.grows

    # By triangles

    def _resolve_substep(
        self,
        kicks: Kicks,
        state: State,
        time: float,
        h: float,
        by_triangles: set[str],
        careful: bool,
    ) -> None:
        """Resolve the contact of a state that has drifted for `h` s from `time`, s."""
        times = np.array([time, time + h])
        for_triangles = [
            each
            for each in self._near
            if each.name in by_triangles or (careful and math.isfinite(each.shape.inner_radius))
        ]
        others = [each for each in self._near if each not in for_triangles]
        if others:
            table = self._table(state, others, times)
            if table is not None:
                kicks.resolve_contact(state, h, table)
                self._take(state, others, table)
        for each in for_triangles:
            self._resolve_triangles(each, state, times, h)
        for each in self._near:
            each.move_to(time + h)
            each.grow(h)

    def _resolve_triangles(
        self, collider: RigidCollider, state: State, times: Array, h: float
    ) -> None:
        broad_phase = self._broad_phase(collider)
        before = collider.rows(state.origin, times[[0, 0]], triangles=True)[0]
        after = collider.rows(state.origin, times, triangles=True)[0]
        start, end = before[9:12], after[9:12]
        shape = collider.shape
        former, self._fastest = self._fastest, max_speed(state)
        approach = h * (max(self._fastest, former) + collider.surface_speed(shape.bounding_radius))
        broad_phase.reduce_clearance(approach)
        collider.max_penetration = 0.0
        if broad_phase.clearance > 0:
            return
        outer = shape.bounding_radius
        particles, triangles = broad_phase.find(state, h, start, end, outer, approach)
        if not len(particles):
            return
        sums = np.zeros(SUMS)
        inner = max(shape.inner_radius - collider.inset, 0.1 * shape.inner_radius)
        depth, touched, forced, pinned = resolve_triangles(
            state.position, state.velocity, state.mobility, particles, triangles, h,
            self._gravity, collider.triangle_kind, before, after, self._fields_of(collider),
            outer, inner, collider.tolerance, sums,
        )  # fmt: skip
        collider.max_penetration = depth
        if touched:
            self.touched = True
            self._unknown = self._unknown or forced or collider.grows
            broad_phase.invalidate()
        if forced and depth > 0.0 and not pinned:
            # Particles are too fast to be pushed out: the collider shrinks to the room there is.
            collider.inset = min(collider.inset + depth, 0.99 * shape.inner_radius)
            collider.max_penetration = 0.0
        collider.take(after, state.origin, sums)

    def _broad_phase(self, collider: RigidCollider) -> BroadPhase:
        if collider.name not in self._broad_phases:
            self._broad_phases[collider.name] = BroadPhase(self._grid)
        return self._broad_phases[collider.name]

    def _fields_of(self, collider: RigidCollider) -> tuple[Array, Array]:
        values, shares = self._fields
        start = self._starts[collider.name]
        return values[start:], shares[start:]

    # Work and forces

    def take_work(self) -> float:
        """
        Return the most work, J, that the colliders can have done since the last call.

        In the frame of a collider, contact adds no energy; in that of the world, an impulse J then
        adds u·J at most, with u the velocity of the surface, and the work against gravity of
        particles that are displaced without an impulse.  The work of a collider that grows in
        touch with the sheet, or that the sheet cannot avoid, is unknown: inf.
        """
        work = self._cell_mass * sum(each.work for each in self.colliders.values())
        for each in self.colliders.values():
            each.work = 0.0
        if self._unknown:
            work = math.inf
        self.touched = self._unknown = False
        return work

    def wrench(self, name: str) -> tuple[Vector, Vector]:
        """Return force, N, and torque, N m, of the sheet on a collider; see `Cloth`."""
        return self.colliders[name].wrench(self._cell_mass)

    # State

    def invalidate(self) -> None:
        """Discard what is known about the state: its velocities were assigned."""
        for each in self.colliders.values():
            each.clearance = 0.0
        for broad_phase in self._broad_phases.values():
            broad_phase.invalidate()

    def respawn(self, state: State) -> None:
        """Shrink colliders to the room that the sheet leaves: either was placed from outside."""
        self.invalidate()
        for each in self.colliders.values():
            each.placed = True
            self._fit(each, state)

    def _fit(self, collider: RigidCollider, state: State) -> None:
        """Shrink a collider that was placed inside the sheet to the room that is there."""
        if not collider.placed:
            return
        collider.placed = False
        collider.inset = collider.max_penetration = 0.0
        depth = self.depth(collider, state)
        if depth > _INSIDE * collider.tolerance:
            collider.inset = min(depth, collider.shape.inner_radius)

    def depth(self, collider: RigidCollider, state: State) -> float:
        """Return the greatest depth of the sheet in a collider, m, or 0."""
        shape, grid = collider.shape, self._grid
        if not self._overlap_possible(collider, state):
            return 0.0
        now = np.zeros(2)
        row = collider.rows(state.origin, now)[0]
        fields = self._fields_of(collider)
        depth: float = depth_of_particles(
            state.position, grid.begin, grid.end, collider.kind, row, fields, _LEAST * self._rho0
        )
        if math.isinf(shape.inner_radius):
            return max(depth, 0.0)
        row = collider.rows(state.origin, now, triangles=True)[0]
        broad_phase = BroadPhase(grid)
        centre = row[9:12]
        particles, triangles = broad_phase.find(
            state, 0.0, centre, centre, shape.bounding_radius, 0.0
        )
        if len(particles):
            deepest = deepest_triangle(
                state.position, state.velocity, state.mobility, particles, triangles,
                collider.triangle_kind, row, fields, shape.bounding_radius, collider.tolerance,
            )  # fmt: skip
            depth = max(depth, deepest)
        return max(depth, 0.0)

    def _overlap_possible(
        self, collider: RigidCollider, state: State, margin: float = 0.0
    ) -> bool:
        """Return False if the sheet is beyond the bounds of a collider; compiles no kernel."""
        sheet = self._grid.interior(state.position).reshape(3, -1).astype(float)
        sheet = sheet + (state.origin - collider.pose[:3])[:, None]
        shape = collider.shape
        if math.isinf(shape.bounding_radius):
            return bool(collider.normal @ sheet.min(axis=1, initial=math.inf) <= margin) or bool(
                (collider.normal @ sheet).min() <= margin
            )
        low, high = sheet.min(axis=1), sheet.max(axis=1)
        apart = np.maximum(np.maximum(low, -high), 0.0)
        return not float(np.linalg.norm(apart)) > shape.bounding_radius + self._rho0 + margin

    def contact_possible(self, state: State, seconds: float, inputs: Inputs) -> bool:
        """Return False if no contact is possible within `seconds`; compiles no kernel."""
        speed = float(np.linalg.norm(state.velocities, axis=0).max())
        for each in self.colliders.values():
            poses = [each.pose, *inputs.collider_paths.get(each.name, ())]
            places = np.array(poses)[:, :3]
            moved = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
            if len(poses) > 1 and math.isinf(each.shape.bounding_radius):
                return True
            if each.grows or self._overlap_possible(each, state, moved + seconds * 2 * speed):
                return True
        return False

    def snapshot(self) -> ContactSnapshot:
        """Return everything about the colliders that later results depend on."""
        colliders = {name: each.snapshot() for name, each in self.colliders.items()}
        return ContactSnapshot(colliders, self._patience, self._rho.copy())

    def restore(self, snapshot: ContactSnapshot, state: State, *, exact: bool) -> None:
        """
        Return to a snapshot; colliders that it lacks, or whose shape differs, are placed.

        Not `exact`: of a scene with other parameters, or of a sheet on another grid.
        """
        self._patience = snapshot.patience
        if exact:
            self._rho[...] = snapshot.rho
        else:
            self._rho[...] = 0
            self.invalidate()
        for name, each in self.colliders.items():
            known = snapshot.colliders.get(name)
            if known is None or not each.restore(known, exact=exact):
                each.placed = True
                self._fit(each, state)

    def warm_up(self, kicks: Kicks, state: State) -> None:
        """Compile the kernels of contact, for a state that none of them changes."""
        grid, none = self._grid, np.zeros(0, np.int32)
        near = list(self.colliders.values())
        self._fastest = max_speed(state)
        layout = (grid.begin, grid.end, grid.stride)
        table = self._tables(tuple(each.kind for each in near), 1)
        self._search(
            state.position, state.velocity, grid.begin, grid.end, 0.0, table,
            np.zeros(len(near)), np.zeros(len(near)),
        )  # fmt: skip
        table.active[...] = 0
        measure_triangles(
            state.position, state.velocity, *layout, 0.0, _LEAST * self._rho0,
            _MOST * self._rho0, self._cells, self._rho,
        )  # fmt: skip
        kicks.resolve_contact(state, 0.0, table)
        has_grown(state.position, *layout, table.rho, table.active, self._cells)
        kicks.resolve_contact(state, 0.0, self._idle)
        each = near[0]
        row = each.rows(state.origin, np.zeros(2), triangles=True)[0]
        fields, sums = self._fields_of(each), np.zeros(SUMS)
        triangles = np.zeros((0, 3), np.int64)
        large_triangles_cut(
            state.position, *layout, table.rho, table.active[0], self._cells, each.triangle_kind,
            row, fields, 1.0,
        )  # fmt: skip
        depth_of_particles(
            state.position, grid.begin, grid.begin, each.kind, row, fields, self._rho0
        )
        broad_phase = BroadPhase(grid)
        broad_phase.find(state, 0.0, row[9:12], row[9:12], 1e9, 0.0)
        resolve_triangles(
            state.position, state.velocity, state.mobility, none, triangles, 0.0, self._gravity,
            each.triangle_kind, row, row, fields, 1.0, 1.0, 1e-5, sums,
        )  # fmt: skip
        deepest_triangle(
            state.position, state.velocity, state.mobility, none, triangles, each.triangle_kind,
            row, fields, 1.0, 1e-5,
        )  # fmt: skip
        self.invalidate()


def _fields_of(
    colliders: Iterable[RigidCollider], dtype: type
) -> tuple[tuple[Array, Array], dict[str, int]]:
    """Return the distances and shares of all meshes, one after the other, and where each begins."""
    values: list[Array] = [np.zeros(1)]
    shares: list[Array] = [np.zeros(1)]
    starts: dict[str, int] = {}
    for each in colliders:
        starts[each.name] = 0
        if each.shape.fields is not None:
            starts[each.name] = sum(map(len, values))
            values.append(each.shape.fields[0])
            shares.append(each.shape.fields[1])
    return (np.concatenate(values).astype(dtype), np.concatenate(shares).astype(dtype)), starts
