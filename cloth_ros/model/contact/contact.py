"""
Contact of the sheet with all colliders of a scene.

A batch of substeps takes the cheapest of these ways that is good enough:

1. A collider that is too far away to be reached has its clearance counted down.
2. Particles near a collider are kept out of its offset surface within the kernel of kicks and
   drifts (`particle_contact`), as long as that keeps the triangles between them out too: the
   collider is not small beside them, it and the sheet do not come near to passing through each
   other within a substep, and at the end of the batch no triangle is larger than was expected.
   Where nothing has moved by much since the last batch, its particles are taken again.
3. Otherwise the batch is made substep by substep, and triangles are moved through each of them
   together with the collider (`triangle_contact`).

A collider that is placed inside the sheet, at the start or by a change from outside, would eject
it at once.  It therefore starts as far inside its surface as there is room, and grows at
`GROWTH_SPEED`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...scene import Scene
from ..grid import Array, Grid
from ..inputs import Inputs, Vector
from ..state import State, max_speed
from .batch_parts import LONGEST, BatchParts, parts_of
from .contact_snapshot import ContactSnapshot
from .contact_table import ContactTable, no_contacts
from .depth_at_pins import DepthAtPins
from .interfaces import Drift, Kicks, Observer
from .mesh_fields import MeshFields
from .particle_batch import ParticleBatch
from .placement import shrink_to_room
from .rigid_collider import RigidCollider
from .substep_contact import SubstepContact
from .surface import Surface
from .triangle_substep import TriangleSubstep

# After a batch that had to be repeated: batches that are made substep by substep, and then those
# that are short.
_BY_SUBSTEPS, _SHORT = 4, 16
# Length of batches, s, in which no collider moves, and particles by less than a circumradius of
# the triangles.
_LONGEST_SLOW = 1 / 60
# Motion of a collider, in circumradii of the triangles, above which batches are short.
_FAST = 2.0


class _Batch(NamedTuple):
    """Kicks and drifts to be made, their duration, s, the velocity of the air, and the time, s."""

    kicks: Kicks
    steps: tuple[Drift, ...]
    seconds: float
    air_velocity: Vector
    time: float


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
    kinds
        Kinds of their shapes, which the kernels must know.
    touched
        True if one has touched the sheet since the last `take_work`.

    """

    def __init__(self, scene: Scene, grid: Grid, dtype: type) -> None:
        sheet = scene.sheet
        self._rho = 0.5 * math.hypot(*sheet.spacing)
        self._extent = 2 * sheet.diagonal or 1.0
        sizes = (self._rho, self._extent, dtype)
        colliders = [RigidCollider(each, *sizes) for each in scene.all_colliders()]
        self.colliders = {each.name: each for each in colliders}
        self.kinds = frozenset([each.kind for each in colliders])
        self.touched = False
        self._fields = fields = MeshFields(colliders, dtype)
        pinned = scene.pinned()
        self._gravity = math.hypot(*scene.gravity)
        self._particles = ParticleBatch(
            grid, dtype, self._rho, self._gravity, pinned, colliders, fields
        )
        self._triangles = TriangleSubstep(grid, fields, np.array(scene.gravity))
        self._substeps = SubstepContact(self._particles, self._triangles)
        self._grid, self._cell_mass = grid, sheet.cell_mass
        self._idle = no_contacts(dtype)
        self._near: list[RigidCollider] = []
        self._fastest = 0.0
        self._patience = 0
        self._unknown = False
        self._held: Array | None = None
        self._at_pins = DepthAtPins(grid, fields, self._particles, pinned)
        self._parts: BatchParts = parts_of(())
        # Positions and velocities at the start of a batch, m and m/s.
        self._before = np.stack([grid.field(dtype), grid.field(dtype)])

    # An advance

    def longest_batch(self, state: State) -> float:
        """Return the duration, s, up to which substeps may make one batch; 0: a short one."""
        colliders = self.colliders.values()
        fastest = max([each.surface_speed(state.origin) for each in colliders])
        calm = LONGEST * fastest < _FAST * self._rho and not self._patience  # False for NaN
        if not calm or True in [e.grows for e in colliders]:
            return 0.0
        slow = fastest == 0 and _LONGEST_SLOW * max_speed(state) < self._rho
        return _LONGEST_SLOW if slow else LONGEST

    def begin_advance(self, state: State, time: float, seconds: float, inputs: Inputs) -> None:
        """Start on the paths that are commanded for an advance of `seconds` from `time`, s."""
        for each in self.colliders.values():
            if not each.begin_advance(time, seconds, inputs):
                self._place(each, state)

    def end_advance(self, state: State) -> None:
        """Place the colliders at the ends of their paths; find how deep pins hold the sheet."""
        for each in self.colliders.values():
            each.end_advance()
        self._at_pins.note(state, self._near)

    def may_act(self, state: State, seconds: float) -> bool:
        """
        Return False if no collider can reach the sheet within `seconds`.

        Not even if the sheet becomes twice as fast in that time, and falls.
        """
        if state.held is not self._held:
            self._held = state.held
            self._particles.hold(state.held)
        self._fastest = max_speed(state)
        gained = self._fastest + self._gravity * seconds
        self._near = self._in_reach(state, seconds, gained)
        # What a collider pushes may become as fast as that.
        pushed = max([each.surface_speed(state.origin) for each in self._near], default=0.0)
        if pushed > 0 and len(self._near) < len(self.colliders):
            self._near = self._in_reach(state, seconds, gained + pushed)
        for each in self.colliders.values():
            if each not in self._near:
                each.max_penetration, each.touching = 0.0, 0
        return bool(self._near)

    def _in_reach(self, state: State, seconds: float, gained: float) -> list[RigidCollider]:
        """Return the colliders that a sheet may reach that gains a speed, m/s."""
        near = []
        for each in self.colliders.values():
            far = each.clearance > seconds * (gained + self._approach(each, state))
            if each.grows or not far:  # as for NaN
                near.append(each)
        return near

    def _approach(self, collider: RigidCollider, state: State) -> float:
        """Return a bound of the speed, m/s, at which collider and sheet approach each other."""
        return self._fastest + collider.surface_speed(state.origin)

    def pass_by(self, state: State, time: float, seconds: float) -> None:
        """Account for a motion of `seconds` from `time`, s, in which no collider was in reach."""
        self._triangles.invalidate()
        self._end_batch(state, time, seconds)

    def act(
        self,
        kicks: Kicks,
        state: State,
        steps: tuple[Drift, ...],
        seconds: float,
        air_velocity: Vector,
        time: float,
        observer: Observer | None,
    ) -> None:
        """
        Make the kicks and drifts of a batch, with contact.

        Parameters
        ----------
        kicks, air_velocity
            Of the scene, and m/s.
        state, time
            At the start of the batch, s; the state is changed.
        steps, seconds
            Of the batch, and their duration, s.
        observer
            Receives every step, or None.

        """
        by_substeps = self._patience > _SHORT
        self._patience = max(self._patience - 1, 0)
        by_particles = observer is None and not by_substeps
        batch = _Batch(kicks, steps, seconds, air_velocity, time)
        if by_particles and self._act_on_particles(batch, state, known=True):
            return
        longest = max([step.drift for step in steps])
        by_triangles = {
            each.name
            for each in self._near
            if each.is_sharp(longest * self._approach(each, state))
        }
        if by_particles and not by_triangles:
            if self._act_on_particles(batch, state, known=False):
                return
            by_substeps = True
            self._patience = _BY_SUBSTEPS - 1 + _SHORT
        if by_substeps:
            by_triangles |= {
                each.name for each in self._near if math.isfinite(each.shape.inner_radius)
            }
        for step in steps:
            kicks.apply(state, (step,), air_velocity, self._idle)
            if observer is not None:
                observer.after_drift(state, step, air_velocity)
            times = np.array([time, time + step.drift])
            outcome = self._substeps.resolve(
                kicks, state, self._near, by_triangles, times, self._fastest
            )
            self.touched = self.touched or outcome.touched
            self._unknown = self._unknown or outcome.unknown
            self._fastest = outcome.fastest
            time += step.drift
            if observer is not None:
                observer.after_contact(state, step)
        self._end_batch(state, time - seconds, seconds)

    def _end_batch(self, state: State, time: float, seconds: float) -> None:
        """
        Account for a motion of `seconds` from `time`, s.

        A collider that the sheet has reached although it was not near counts as placed inside it:
        what accelerates it from rest, by more than the clearance, cannot be foreseen.
        """
        self._fastest = max(self._fastest, max_speed(state))
        for each in self.colliders.values():
            each.clearance -= seconds * self._approach(each, state)
            each.move_to(time + seconds)
            if each not in self._near and not each.clearance >= 0:  # as for NaN
                self._place(each, state)

    def surfaces(self, state: State, time: float, *, near: bool = True) -> list[Surface]:
        """Return the surfaces at a time, s, of colliders: those near in the last batch, or all."""
        rho, times = self._particles.rho, np.array([time, time])
        return [
            Surface(each.kind, each.rows(state.origin, times)[0], self._fields.of(each), rho)
            for each in (self._near if near else self.colliders.values())
        ]

    # By particles

    def _act_on_particles(self, batch: _Batch, state: State, *, known: bool) -> bool:
        """
        Make a batch with contact of particles; return False, and undo it, if that is not enough.

        With `known`, it is contact of those that were in reach in the last batch: enough if
        nothing moves by much.
        """
        particles, (kicks, steps, seconds, air_velocity, time) = self._particles, batch
        table = particles.found(state, self._near, seconds, self._fastest) if known else None
        if known and table is None:
            return False
        before, mark = self._before, kicks.mark()
        before[0], before[1] = state.position, state.velocity
        if table is not None:
            kicks.apply(state, steps, air_velocity, table)
            enough = particles.held(seconds, self._fastest, max_speed(state))
        else:
            table = self._make_parts(batch, state)
            enough = not particles.cut(state, self._near, table, time + seconds)
        if not enough:
            state.position[...], state.velocity[...] = before
            kicks.go_back(mark)
            return False
        touching = particles.take(state, self._near, table)
        self.touched = self.touched or len(touching) > 0
        self._unknown = self._unknown or True in [each.grows for each in touching]
        for each in self._near:
            each.max_penetration = 0.0
            each.grow(seconds)
        self._triangles.invalidate()
        self._end_batch(state, time, seconds)
        return True

    def _make_parts(self, batch: _Batch, state: State) -> ContactTable:
        """Make a batch part by part, with contact of particles; return its table."""
        if self._parts.steps is not batch.steps:  # most batches have the same steps
            self._parts = parts_of(batch.steps)
        _, times, parts = self._parts
        self._particles.measure(state, parts[0].seconds, self._fastest)
        table = self._particles.table(state, self._near, batch.time + times, self._fastest)
        acts, made = table.active.any(), 0
        for each in parts:
            if made > 0:
                self._particles.measure(state, each.seconds, max_speed(state))
            contacts = table.rows_from(made) if acts else None
            batch.kicks.apply(state, each.steps, batch.air_velocity, contacts)
            made += len(each.steps)
        return table

    # Work and forces

    def take_work(self) -> float:
        """
        Return the most work, J, that the colliders can have done since the last call.

        In the frame of a collider, contact adds no energy; in that of the world, an impulse J then
        adds u·J at most, with u the velocity of the surface, and the work against gravity of
        particles that are displaced without an impulse.  The work of a collider that grows in
        touch with the sheet, or that the sheet cannot avoid, is unknown: inf.
        """
        work = 0.0
        for each in self.colliders.values():
            work += self._cell_mass * each.work
            each.work = 0.0
        if self._unknown:
            work = math.inf
        self.touched = self._unknown = False
        return work

    # State

    def invalidate(self) -> None:
        """Discard what is known about the state: its velocities were assigned."""
        self._particles.invalidate()
        self._triangles.invalidate()
        for each in self.colliders.values():
            each.clearance = 0.0

    def respawn(self, state: State) -> None:
        """Shrink colliders to the room that the sheet leaves: either was placed from outside."""
        self.invalidate()
        for each in self.colliders.values():
            self._place(each, state)

    def _place(self, collider: RigidCollider, state: State) -> None:
        shrink_to_room(collider, state, self._rho, self._particles, self._triangles)

    def contact_possible(self, state: State, seconds: float, inputs: Inputs) -> bool:
        """Return False if no contact is possible within `seconds`; compiles no kernel."""
        sheet = state.world_positions.reshape(3, -1)
        reach = self._rho + seconds * 2 * float(np.linalg.norm(state.velocities, axis=0).max())
        possible = [each.may_reach(sheet, reach, inputs) for each in self.colliders.values()]
        return True in possible

    def snapshot(self, state: State) -> ContactSnapshot:
        """Return everything about the colliders that later results depend on."""
        colliders = {name: each.snapshot() for name, each in self.colliders.items()}
        particles = self._particles
        return ContactSnapshot(
            colliders, self._patience, particles.rho.copy(), particles.elapsed, particles.moved,
            particles.excess, *particles.known(state),
        )  # fmt: skip

    def restore(self, snapshot: ContactSnapshot, state: State, *, exact: bool) -> None:
        """
        Return to a snapshot; colliders that it lacks, or whose shape differs, are placed.

        Not `exact`: of a scene with other parameters, or of a sheet on another grid.
        """
        self._patience = snapshot.patience
        particles = self._particles
        if exact:
            self._triangles.invalidate()
            particles.rho[...] = snapshot.rho
            particles.elapsed, particles.moved = snapshot.elapsed, snapshot.moved
            particles.excess = snapshot.excess
        else:
            particles.rho[...] = 0
            self.invalidate()
        for name, each in self.colliders.items():
            known = snapshot.colliders.get(name)
            if known is None or not each.restore(known, exact=exact):
                self._place(each, state)
        if exact:
            colliders = [self.colliders[name] for name in snapshot.known]
            particles.search_again(state, colliders, snapshot.left)

    def warm_up(self, kicks: Kicks, state: State) -> None:
        """Compile the kernels of contact, for a state that none of them changes."""
        colliders = list(self.colliders.values())
        kicks.resolve_contact(state, 0.0, self._particles.warm_up(colliders, state))
        self._triangles.warm_up(colliders[0], state)
        self.invalidate()
