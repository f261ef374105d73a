"""
Kicks and drifts of a scene's particles, by the forces that the scene has.

Springs are fast and dissipation is slow: the air, drag, or a dashpot, changes a velocity far less
in a substep than a stiff spring does.  An integrator may therefore apply dissipation in one of
several substeps, as many times as strongly: multiple time stepping with impulses (M. Tuckerman,
B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992, section II).  In single precision, this also
keeps more digits of slow dissipation.
"""

from __future__ import annotations

import functools
import itertools
import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...scene import Scene
from ..contact.contact_table import ContactTable, no_contacts
from ..forces import aerodynamics, springs
from ..grid import Array, Grid
from ..grippers.grippers import Grippers
from ..kernels.thread_pool import CHUNK, shared_thread_pool
from ..self_contact.self_contact import SelfContact
from ..stability import rate_bounds
from ..state import State
from . import kick_drift_kernel as kernel
from .dashpot_stages import stages_for
from .integrator import Step

# Particles from which on several threads are faster than one.
_MIN_THREADED = 4096
# Tables of operations that are kept; one motion uses a few at a time.
_MAX_TABLES = 64

Vector = tuple[float, float, float]
# Of the kernel's table.
Row = tuple[float, float, float, float, float, float]
_STILL: Vector = (0.0, 0.0, 0.0)


class KickDrift:
    """
    Kicks by springs, gravity, dashpots, drag and air, and drifts.

    Drag is a rate γ, dv/dt = a − γ v, and is integrated exactly for constant a,

        v ← e^(−γ h) v + a (1 − e^(−γ h)) / γ,

    so that neither the decay nor the terminal velocity a/γ depends on the step; with n γ in one of
    n steps, the latter does by (n γ h)²/12.  Dashpots act on the velocity in the middle of the
    kick, in as many stages as they need to be stable (see `dashpot_stages`).  So every kick is of
    second order at resting positions.

    Parameters
    ----------
    scene, grid
        Forces, and the sheet on which they act.
    dtype
        numpy.float32 or numpy.float64.
    separate
        True to accelerate and kick in separate loops, for callers of `accelerate`.
    extra_drag
        Decay rate of velocity on top of the scene's, 1/s; with it, both act in every kick.
    kinds
        Kinds of the shapes that the sheet may touch, see `contact.shapes`.
    several
        True if it may touch more than one collider.
    grippers
        Hold particles in each drift; None: the scene has none.
    self_contact
        Contact of the sheet with itself, after each kick and drift; None: the scene has none.

    Attributes
    ----------
    damped
        True if accelerations depend on velocities: the scene has dashpots.
    dissipative
        True if the weight of a step matters: the scene has dashpots or air.
    work
        Of the air since the last `take_work`, by chunk, J for cells of 1 kg.

    """

    def __init__(
        self,
        scene: Scene,
        grid: Grid,
        dtype: type,
        *,
        separate: bool = False,
        extra_drag: float = 0.0,
        kinds: frozenset[int] = frozenset(),
        several: bool = False,
        grippers: Grippers | None = None,
        self_contact: SelfContact | None = None,
    ) -> None:
        self._separate, self._grippers, self._self_contact = separate, grippers, self_contact
        present = {family.name for family in springs.spring_families(scene)}
        self.damped = bool(present) and scene.springs.damping > 0
        self._air = aerodynamics.coefficient(scene) if scene.has_air else 0.0
        self.dissipative = self.damped or scene.has_air
        self._mass = scene.sheet.cell_mass
        # Decay rates of velocity: times the weight of a step, and in every step.
        self._drag, self._steady_drag = scene.drag, 0.0
        if extra_drag:
            self._drag, self._steady_drag = 0.0, scene.drag + extra_drag
        # Damping by dashpots per unit mass, 1/s: of one dashpot, and the largest of the sheet.
        self._dashpots = scene.springs.damping / scene.sheet.cell_mass
        _, self._viscous = rate_bounds(scene)
        threaded = grid.rows * grid.columns >= _MIN_THREADED
        self._threads = shared_thread_pool(scene.solver.threads if threaded else 1)
        separate = separate or self.dissipative
        compose = functools.partial(
            kernel.compose,
            *(name in present for name in springs.SPRING_TYPES),
            self.damped,
            scene.has_air,
            separate,
            dtype is np.float64,
            gripping=grippers is not None,
        )
        self._kernel = compose()
        with_contact = functools.partial(compose, kinds=kinds, several=several)
        self._contact_kernel = with_contact() if kinds else self._kernel
        # For batches with contact of the sheet with itself: others cost no more than without it.
        self._sweeping_kernel = self._kernel
        if self_contact is not None:
            self._sweeping_kernel = with_contact(sweeping=True)
        self._tables: dict[tuple[bool, bool, tuple[Step, ...]], Array] = {}
        self._range = (grid.begin, grid.end, grid.stride)
        self._springs = tuple(dtype(number) for number in springs.spring_constants(scene))
        self._bounds = tuple(dtype(number) for number in aerodynamics.BOUNDS)
        # Arrays of absent effects take no memory, but have a shape that the kernel accepts.
        unused: Array = np.zeros((3, 0), dtype)
        self._midpoint = grid.field(dtype) if separate else unused
        self._stage = grid.field(dtype) if self.damped else unused
        self._former = grid.field(dtype) if kinds or self_contact is not None else unused
        self._no_contacts = no_contacts(dtype)
        self.work = np.zeros((grid.end - grid.begin) // CHUNK + 1)

    def apply(
        self,
        state: State,
        steps: tuple[Step, ...],
        air_velocity: Vector,
        contacts: ContactTable | None = None,
    ) -> None:
        """Make the kicks and drifts of `steps` in air of a velocity, m/s, with contact if any."""
        sweeps = self._self_contact is not None and self._self_contact.contacts > 0
        key = (sweeps or contacts is not None, sweeps, steps)
        table = self._tables.get(key)
        if table is None:
            if len(self._tables) == _MAX_TABLES:
                self._tables.clear()
            table = self._tables[key] = np.array(list(self._rows(*key)))
        grips = () if self._grippers is None else self._grippers.table(state, steps)
        self.run(state, table, air_velocity, contacts, grips, sweeps=sweeps)

    def mark(self) -> Any:
        """Return what `apply` changes besides the state, for `go_back`."""
        return self.work.copy(), None if self._grippers is None else self._grippers.mark()

    def go_back(self, mark: Any) -> None:
        """Undo what was applied since `mark`, but for the state."""
        self.work[...] = mark[0]
        if self._grippers is not None:
            self._grippers.go_back(mark[1])

    def time_without_effect(
        self, state: State, steps: tuple[Step, ...], air_velocity: Vector
    ) -> float:
        """Make steps, and undo them; return their wall-clock time, s."""
        position, velocity, mark = state.position.copy(), state.velocity.copy(), self.mark()
        start = time.perf_counter()
        self.apply(state, steps, air_velocity)
        seconds = time.perf_counter() - start
        self.go_back(mark)
        state.position[...], state.velocity[...] = position, velocity
        return seconds

    def resolve_contact(self, state: State, h: float, contacts: ContactTable) -> None:
        """Resolve the contact of a state that has just drifted for `h` s."""
        self.run(state, np.array([(kernel.RESOLVE, 1.0, 0.0, h, 0.0, 0.0)]), _STILL, contacts)

    def warm_up_sweeps(self, state: State) -> None:
        """Compile the kernel of contact of the sheet with itself, if the scene has that."""
        if self._self_contact is not None:
            table = np.array([(kernel.SWEEP_BETWEEN, 1.0, 0.0, 0.0, 0.0, 0.0)])
            self.run(state, table, _STILL, sweeps=True)

    def accelerate(self, state: State) -> None:
        """Write the accelerations by gravity, springs and dashpots; needs `separate`."""
        rows: list[Row] = [(kernel.ACCELERATE, 1.0, 0.0, 0.0, 0.0, 0.0)]
        if self.damped:
            rows.append((kernel.KICK_TO_MIDPOINT, 1.0, 0.0, 0.0, 0.0, 0.0))
            rows.append((kernel.DAMP, 1.0, 0.0, 0.0, self._dashpots, 1.0))
        self.run(state, np.array(rows), _STILL)

    def take_work(self) -> float:
        """Return the work, J, of the air on what it has accelerated since the last call."""
        work = self._mass * float(self.work.sum())
        self.work[:] = 0
        return work

    def _rows(self, touched: bool, sweeps: bool, steps: tuple[Step, ...]) -> Iterator[Row]:
        """Yield the rows of the kernel's table for steps, with contact and sweeps, or without."""
        # Where dashpots act for one step each, they push a particle at rest in every one.
        resisting = touched and self.damped and any(step.weight > 1 for step in steps)
        before: Step | None = None
        for step, following in itertools.zip_longest(steps, steps[1:]):
            resisted = resisting and step.weight > 0 and before is not None
            if before is not None and resisted:
                decay, gain = self._factors(before)
                yield (kernel.FIND_CONTACT_KICK, decay, gain, 0.0, 0.0, 0.0)
            separate = resisting and following is not None and following.weight > 0
            yield from self.operations(step, resisted=resisted, separate=separate)
            before = step if step.kick is not None else None
            # Contacts of the sheet with itself act after the kick.
            if sweeps and step.kick is not None:
                yield (kernel.SWEEP_SIDES, 1.0, 0.0, step.drift, 0.0, 0.0)
                yield (kernel.SWEEP_BETWEEN, 1.0, 0.0, step.drift, 0.0, 0.0)
                yield (kernel.END_SWEEPS, 1.0, 0.0, step.drift, 0.0, 0.0)

    def operations(
        self, step: Step, *, resisted: bool = False, separate: bool = False
    ) -> Iterator[Row]:
        """
        Yield the rows of the kernel's table for a step, see `kick_drift_kernel`.

        Parameters
        ----------
        step
            Its kick and drift.
        resisted
            True if the dashpots take account of contact: what that has changed in the step before,
            `stage` holds.  A particle that rests would otherwise seem to move with half of its
            kick, and dashpots that act for many steps at once would jerk its neighbours; they do
            in the first step of a batch, and where steps are made one at a time.
        separate
            True to accelerate in an operation of its own.

        """
        h, drift, weight = step
        if h is None:
            yield (kernel.DRIFT, 1.0, 0.0, drift, 0.0, 0.0)
            return
        decay, gain = self._factors(step)
        separate = separate or self._separate
        if not separate and (weight == 0 or not self.dissipative):
            yield (kernel.KICK_BY_SPRINGS, decay, gain, drift, 0.0, 0.0)
            return
        yield (kernel.ACCELERATE, 1.0, 0.0, 0.0, 0.0, 0.0)
        if self.damped and weight:
            half = self._factors(step._replace(kick=0.5 * h))
            air = weight * half[1] * self._air
            yield (kernel.KICK_TO_MIDPOINT, *half, 0.0, air, float(resisted))
            yield from self._dashpot_stages(weight * h, half[0] / gain)
        yield (kernel.KICK, decay, gain, drift, weight * gain * self._air, 0.0)

    def _factors(self, step: Step) -> tuple[float, float]:
        """Return the factors of velocity, 1, and acceleration, s, in the kick of a step."""
        return _drag_factors(step.kick or 0.0, step.weight * self._drag + self._steady_drag)

    def _dashpot_stages(self, seconds: float, factor: float) -> Iterator[Row]:
        """Yield the stages that add `factor` times the change of velocity in so many s."""
        chosen = stages_for(seconds * self._viscous)
        for count, stage in enumerate(chosen.stages, 1):
            share = factor * chosen.share if count == len(chosen.stages) else 0.0
            before, two_before, rate = stage
            yield (kernel.DAMP, count, before, two_before, seconds * self._dashpots * rate, share)

    def run(
        self,
        state: State,
        table: Array,
        air_velocity: Vector,
        contacts: ContactTable | None = None,
        grips: tuple[Any, ...] = (),
        *,
        sweeps: bool = False,
    ) -> None:
        """Run the operations of a table, shape (n, 6); `sweeps` if some are such."""
        if self._grippers is not None:
            grips = grips or self._grippers.unmoved
        x, y, z = air_velocity
        number = state.dtype
        chosen = self._kernel if contacts is None else self._contact_kernel
        sheet_contacts: tuple[Any, ...] = ()
        if sweeps and self._self_contact is not None:
            chosen, sheet_contacts = self._sweeping_kernel, self._self_contact.in_kernel
        self._threads.run(
            chosen,
            *self._range,
            table,
            state.position,
            state.back_buffer,
            state.velocity,
            self._former,
            self._midpoint,
            self._stage,
            state.acceleration,
            state.mobility,
            self._springs,
            (number(x), number(y), number(z)),
            self._bounds,
            self.work,
            self._no_contacts if contacts is None else contacts,
            grips,
            sheet_contacts,
        )
        if np.count_nonzero(table[:, 0] <= kernel.KICK) % 2:
            state.position, state.back_buffer = state.back_buffer, state.position


def _drag_factors(h: float, drag: float) -> tuple[float, float]:
    """Return the factors of velocity, 1, and acceleration, s, in a kick of `h` s."""
    if drag == 0:
        return 1.0, h
    return math.exp(-drag * h), -math.expm1(-drag * h) / drag
