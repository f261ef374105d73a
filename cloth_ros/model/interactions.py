"""
What acts on a sheet besides the forces of its integrator: grippers, colliders, the sheet itself.

Each is absent where the scene does not have it.  Their order is fixed: grippers and colliders act
after each drift, in this order and mostly within the kernel of kicks and drifts; contact of the
sheet with itself acts after them, and at the end of a part of a batch may undo what they have done
to positions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..scene import Scene
from .contact.contact import Contact
from .contact.interfaces import Observer
from .grid import Array, Grid
from .grippers.grippers import Grippers
from .inputs import Inputs, Vector
from .integrators.integrator import Step
from .integrators.kick_drift import KickDrift
from .self_contact.self_contact import SelfContact, self_contact_of
from .snapshot import Snapshot
from .state import State
from .time_step import CHECK_INTERVAL, ROUNDING

# Longest part, s, of a sheet that may touch itself, unless `CHECK_INTERVAL` substeps are longer.
_PART = 1 / 240


class Interactions:
    """
    Grippers, contact with colliders, and contact of a sheet with itself.

    Parameters
    ----------
    scene, grid, dtype
        What there is, and the sheet on which it acts.

    Attributes
    ----------
    grippers, contact, self_contact
        None: the scene has none.
    in_kernel
        What of these the kernel of kicks and drifts must know, as parameters of `KickDrift`.

    """

    def __init__(self, scene: Scene, grid: Grid, dtype: type) -> None:
        colliders = scene.all_colliders()
        self.grippers = Grippers(scene, grid) if scene.grippers else None
        self.contact = Contact(scene, grid, dtype) if colliders else None
        self.self_contact: SelfContact | None = self_contact_of(scene, grid, dtype)
        self.in_kernel: dict[str, Any] = {}
        if self.grippers is not None:
            self.in_kernel['grippers'] = self.grippers
        if self.contact is not None:
            self.in_kernel |= {'kinds': self.contact.kinds, 'several': len(colliders) > 1}
        if self.self_contact is not None:
            self.in_kernel['self_contact'] = self.self_contact

    # State

    def check(self, name: str, positions: Array) -> None:
        """Refuse positions, m, shape (3, rows, columns), of a sheet that passes through itself."""
        if self.self_contact is not None:
            self.self_contact.check(name, positions)

    def snapshot(self, state: State) -> dict[str, Any]:
        """Return what a `Snapshot` has of these, by its fields."""
        return {
            'contact': None if self.contact is None else self.contact.snapshot(state),
            'grippers': None if self.grippers is None else self.grippers.snapshot(),
            'pace': (1, 0) if self.self_contact is None else self.self_contact.pace,
        }

    def restore(self, snapshot: Snapshot, state: State, *, exact: bool) -> None:
        """Return to a snapshot, whose positions the state has; `exact` as in `Contact.restore`."""
        if self.grippers is not None:
            self.grippers.restore(snapshot.grippers or {}, state)
        if self.self_contact is not None:
            self.self_contact.restart(snapshot.pace)
        if self.contact is not None and snapshot.contact is not None:
            self.contact.restore(snapshot.contact, state, exact=exact)
        elif self.contact is not None:
            self.contact.respawn(state)

    def accept_assigned_state(self, state: State, *, moved: bool) -> None:
        """Continue from a state whose velocities, and if `moved` positions, were assigned."""
        if self.grippers is not None and moved:
            self.grippers.place(state)
        if self.self_contact is not None:
            self.self_contact.restart()
        if self.contact is not None:
            if moved:
                self.contact.respawn(state)
            else:
                self.contact.invalidate()

    # Advance

    def begin_advance(self, state: State, time: float, seconds: float, inputs: Inputs) -> None:
        """Start on the paths and take the commands for an advance of `seconds` from `time`, s."""
        if self.grippers is not None:
            self.grippers.begin_advance(state, time, seconds, inputs)
        if self.contact is not None:
            self.contact.begin_advance(state, time, seconds, inputs)

    def end_advance(self, state: State) -> None:
        """Place colliders and grippers at the ends of their paths."""
        if self.contact is not None:
            self.contact.end_advance(state)
        if self.grippers is not None:
            self.grippers.end_advance()

    def end_batch(self, state: State, seconds: float) -> None:
        """Let particles slip out of grips that were pulled too hard in a batch of `seconds`."""
        if self.grippers is not None:
            self.grippers.slip(state, seconds)

    def longest_part(self, state: State, count: int, h: float, most: int) -> int:
        """Return how many of the next `count` substeps of `h` s, or `most`, are made at once."""
        if self.contact is not None:
            batch = (1 - ROUNDING) * self.contact.longest_batch(state)
            most = min(most, max(math.ceil(batch / h), CHECK_INTERVAL))
        if self.self_contact is not None:
            if not self.self_contact.is_calm(state, min(count, most) * h):
                most = min(most, max(int((1 + ROUNDING) * _PART / h), CHECK_INTERVAL))
            most = self.self_contact.part(count, most)
        return most

    def apply(
        self,
        kick_drift: KickDrift,
        state: State,
        steps: tuple[Step, ...],
        seconds: float,
        air_velocity: Vector,
        time: float,
        observer: Observer | None,
    ) -> None:
        """
        Make kicks and drifts, with everything that acts on the sheet meanwhile.

        Parameters
        ----------
        kick_drift, air_velocity
            Of the scene, and m/s.
        state, time
            At the start, s; the state is changed.
        steps, seconds
            Kicks and drifts, and their duration, s.
        observer
            Receives every step, or None.

        """
        if self.grippers is not None:
            self.grippers.begin_steps(state, time)
        contact = self.contact
        if contact is not None and not contact.may_act(state, seconds):
            contact = None
        if self.self_contact is not None:
            surfaces = () if contact is None else contact.surfaces(state, time)
            self.self_contact.begin_part(state, seconds, surfaces)
        if contact is not None:
            contact.act(kick_drift, state, steps, seconds, air_velocity, time, observer)
        else:
            _apply_freely(kick_drift, state, steps, air_velocity, observer)
            if self.contact is not None:
                self.contact.pass_by(state, time, seconds)
        if self.self_contact is not None:
            self.self_contact.end_part(state)
        if self.grippers is not None:
            self.grippers.end_steps()

    # Work

    @property
    def touched(self) -> bool:
        """True if there was contact since the last `take_work`."""
        contact, own = self.contact, self.self_contact
        return (contact is not None and contact.touched) or (own is not None and own.touched)

    def take_work(self) -> float:
        """Return the work, J, of colliders and grippers since the last call; inf: unknown."""
        work = 0.0 if self.contact is None else self.contact.take_work()
        if self.grippers is not None:
            work += self.grippers.take_work()
        if self.self_contact is not None:
            self.self_contact.touched = False
        return work

    # Compilation

    def warm_up(self, state: State) -> None:
        """Compile the kernels of contact of the sheet with itself."""
        if self.self_contact is not None:
            self.self_contact.warm_up(state)

    def warm_up_contact(self, kick_drift: KickDrift, state: State, time: float) -> None:
        """Compile the kernels of contact with colliders."""
        assert self.contact is not None
        self.contact.warm_up(kick_drift, state)
        if self.self_contact is not None:
            surfaces = self.contact.surfaces(state, time, near=False)
            self.self_contact.warm_up_supports(state, surfaces)


def _apply_freely(
    kick_drift: KickDrift,
    state: State,
    steps: Sequence[Step],
    air_velocity: Vector,
    observer: Observer | None,
) -> None:
    """Make kicks and drifts out of reach of all colliders; an observer receives each of them."""
    if observer is None:
        kick_drift.apply(state, tuple(steps), air_velocity)
        return
    for step in steps:
        kick_drift.apply(state, (step,), air_velocity)
        observer.after_drift(state, step, air_velocity)
        observer.after_contact(state, step)
