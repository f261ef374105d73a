"""
Advance a cloth in time: batches of substeps, each accepted or rolled back.

An advance is cut where the air velocity changes, and then into batches of substeps, after each of
which the energy monitor accepts the state or has the batch repeated.  Step control divides a batch
further where the cloth is fast.  Contact makes the batches in which a collider may touch the
sheet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from ..scene import Scene
from .contact.interfaces import Observer
from .energy_monitor import DAMPED_DIVISION, DIVISIONS, EnergyMonitor, RollbackCounts
from .forces.gusts import Gusts
from .grid import Array, Grid, flat_sheet
from .inputs import Inputs, Vector
from .integrators import Integrator
from .integrators.damped_euler import DampedEuler
from .integrators.integrator import Step, SubstepBatch
from .integrators.kick_drift import KickDrift
from .interactions import Interactions
from .precision import precision_for
from .snapshot import Snapshot
from .stability import rate_bounds
from .state import State, max_speed
from .step_control import StepControl
from .time_step import BATCH, CHECK_INTERVAL, ROUNDING, integrator_for, part

_DTYPES = {'single': np.float32, 'double': np.float64}

MAX_SECONDS = 1e6  # of one advance
# Substeps whose cost is measured.
_TIMED = CHECK_INTERVAL
# Relative difference of two substep lengths that are made equal: times are rounded, and each
# other length would need tables of its own.
_EQUAL = 1e-8
# Multiple of the interval of step control above which an advance is cut into intervals.
_LONG = 1.5

# Of the snapshot at the start of a batch: the inputs of the advance in progress stay in force.
_NO_INPUTS = Inputs()

Steps = Callable[[SubstepBatch], tuple[Step, ...]]


class Simulation:
    """
    State of a scene and its time integration.

    Parameters
    ----------
    scene
        Parameters, which `check_scene` has accepted.
    step_control
        Lengths of substeps.
    energy_monitor
        Accepts or rejects batches; None: all are accepted.
    observer
        Receives every substep; None: nothing does.
    rollbacks
        Where repeated batches are counted.

    Attributes
    ----------
    state, time
        Particles, and simulated time, s.
    interactions
        What acts on the sheet besides the forces of the integrator.
    substeps
        Number of substeps of the last advance.
    work
        Most work, J, that air, colliders and grippers can have done since the start or last reset.

    """

    def __init__(
        self,
        scene: Scene,
        step_control: StepControl,
        energy_monitor: Callable[[Scene, type], EnergyMonitor] | None,
        observer: Observer | None,
        rollbacks: RollbackCounts,
    ) -> None:
        dtype = _DTYPES[precision_for(scene)]
        self.scene, self.step_control, self.rollbacks = scene, step_control, rollbacks
        self.grid = Grid(scene.sheet.rows, scene.sheet.columns)
        self.state = State(self.grid, dtype)
        pinned = scene.pinned()
        self._pinned = bool(pinned.any())
        self.state.pin(pinned)
        self.time = self.work = 0.0
        self.substeps = 0
        self.interactions = Interactions(scene, self.grid, dtype)
        self._gusts = Gusts(scene.wind.gust) if scene.wind.gust.period > 0 else None
        self._air_velocity: Vector = (0.0, 0.0, 0.0)
        self._kick_drift = KickDrift(scene, self.grid, dtype, **self.interactions.in_kernel)
        self._integrator: type[Integrator] = integrator_for(scene)
        self._monitor = None if energy_monitor is None else energy_monitor(scene, dtype)
        self._observer = observer
        self._batch_start: Snapshot | None = None

    # State

    def start(self) -> None:
        """Lay out the undeformed sheet where the scene has it, at rest."""
        sheet, state = self.scene.sheet, self.state
        state.origin = np.array(sheet.position)
        state.grid.interior(state.position)[...] = flat_sheet(
            sheet.rows, sheet.columns, sheet.spacing, sheet.orientation
        )
        self.accept_assigned_state(moved=True)

    def snapshot(self, inputs: Inputs) -> Snapshot:
        """Return an immutable copy of everything that later results depend on."""
        return self._snapshot(inputs, self.state.position.copy(), self.state.velocity.copy())

    def _snapshot(self, inputs: Inputs, position: Array, velocity: Array) -> Snapshot:
        """Return a snapshot with these arrays."""
        return Snapshot(
            scene=self.scene,
            grid=self.grid,
            origin=self.state.origin,
            position=position,
            velocity=velocity,
            time=self.time,
            work=self.work,
            account=None if self._monitor is None else self._monitor.account(),
            inputs=inputs,
            steps=self.step_control.account(),
            **self.interactions.snapshot(self.state),
        )

    def restore(self, snapshot: Snapshot) -> None:
        """
        Return to a snapshot of this scene to the bit, or convert one of another scene.

        The precision and the grid may differ; another grid is interpolated linearly.
        """
        resample = snapshot.grid != self.grid
        if resample:
            snapshot = snapshot.resampled(self.scene)
        self.interactions.check('the state', self.grid.interior(snapshot.position))
        exact = snapshot.scene == self.scene and snapshot.position.dtype == self.state.dtype
        self._restore_motion(snapshot, exact=exact and not resample)
        self.work, self.substeps = snapshot.work, 0
        if resample and self.interactions.contact is not None:
            self.interactions.contact.respawn(self.state)
        self.state.velocity *= self.state.free
        if self._monitor is not None:
            self._monitor.restore(snapshot.account if exact and not resample else None)
        self.step_control.restore(None if resample else snapshot.steps)

    def _restore_motion(self, snapshot: Snapshot, *, exact: bool = True) -> None:
        """Return to the motion of a snapshot, without its energy account."""
        self.state.origin = snapshot.origin
        position, velocity = self.state.position, self.state.velocity
        if snapshot.position.dtype == position.dtype:
            position[...], velocity[...] = snapshot.position, snapshot.velocity
        else:  # without the ghosts, which the other precision has rounded
            interior = self.grid.interior
            interior(position)[...] = interior(snapshot.position)
            interior(velocity)[...] = interior(snapshot.velocity)
        self.time = snapshot.time
        self._take_work()
        self.interactions.restore(snapshot, self.state, exact=exact)

    def accept_assigned_state(self, *, moved: bool) -> None:
        """Continue from a state whose velocities, and if `moved` positions, were assigned."""
        if self._monitor is not None:
            self._monitor.reset()
        self.step_control.restore(None)
        self._take_work()
        self.interactions.accept_assigned_state(self.state, moved=moved)

    # Advance

    def air_velocity(self, wind: Vector) -> Vector:
        """Return the velocity of the air now, m/s: wind and gusts."""
        return self._air_at(self.time, wind)

    def _air_at(self, time: float, wind: Vector) -> Vector:
        if self._gusts is None:
            return wind
        x, y, z = (np.array(wind) + self._gusts.velocity(time)).tolist()
        return (x, y, z)

    def advance_stepwise(self, seconds: float, inputs: Inputs) -> Iterator[None]:
        """Advance, and pause after each batch; see `Cloth.advance_stepwise`."""
        if self.time + seconds == self.time:  # zero, or less than the resolution of time
            return
        self.interactions.begin_advance(self.state, self.time, seconds, inputs)
        self.substeps = 0
        end, interval = self.time + seconds, self.step_control.adapt_interval
        self.step_control.begin(self.state, self.time)
        while self.time < end:
            begin, change = self.time, end
            substep = self.step_control.substep
            # Less counts as nothing: contact divides depths by the time, and both are rounded.
            rounding = ROUNDING * substep
            if end - begin > _LONG * interval:
                change = begin + interval
            if self._gusts is not None:
                change = min(change, self._gusts.next_change(begin + rounding))
            if end - change < rounding:
                change = end
            self._air_velocity = self._air_at(0.5 * (begin + change), inputs.wind)
            count = max(math.ceil((change - begin) / substep - ROUNDING), 1)
            h = (change - begin) / count
            if abs(h - substep) <= _EQUAL * substep:
                h = substep
            while count > 0:
                substeps = part(count, BATCH)
                count -= substeps
                yield from self._batch(substeps, h)
                self.interactions.end_batch(self.state, substeps * h)
            self.time = change
            self.step_control.adapt(self.state, change)
        self.interactions.end_advance(self.state)

    def _batch(self, count: int, h: float) -> Iterator[None]:
        """Make so many substeps; repeat them as `energy_monitor` says if they are rejected."""
        monitor, steps = self._monitor, self._integrator.steps
        if monitor is None:
            yield from self._run(self._kick_drift, steps, count, h, 1)
            return
        monitor.begin_batch(self.state)
        self._save_batch_start()
        while True:
            yield from self._run(self._kick_drift, steps, count, h, monitor.division)
            touched = self.interactions.touched
            work = self._take_work()
            if self._accept(monitor, work, touched=touched):
                return
            if not self.step_control.shorten(self.time):
                if monitor.division == DIVISIONS[-1]:
                    break
                monitor.refine()
            self._roll_back()
            self.rollbacks.refined += 1
        if monitor.rescale_velocities(self.state, work):
            self.rollbacks.limited += 1
            if self._accept(monitor, work):
                return
        self._roll_back()
        self.rollbacks.damped += 1
        yield from self._run(self._damped(h), DampedEuler.steps, count, h, DAMPED_DIVISION)
        if self._accept(monitor, self._take_work()):
            return
        self._roll_back()
        self.rollbacks.held += 1
        self.state.velocity[...] = 0
        self._apply(self._kick_drift, (Step(None, h),) * count, count * h)
        self._take_work()
        if not self._accept(monitor, math.inf):  # not even contact alone, from rest
            self._roll_back()
            self.state.velocity[...] = 0
            self.time += count * h
            self._accept(monitor, math.inf)

    def _accept(self, monitor: EnergyMonitor, work: float, *, touched: bool = False) -> bool:
        accepted = monitor.accepts(self.state, work, touched=touched)
        if accepted:
            self.work += monitor.work
        return accepted

    def _save_batch_start(self) -> None:
        """Keep the state to which a rejected batch is rolled back, in the same arrays again."""
        before, state = self._batch_start, self.state
        if before is None:
            self._batch_start = self.snapshot(_NO_INPUTS)
            return
        before.position[...], before.velocity[...] = state.position, state.velocity
        self._batch_start = self._snapshot(_NO_INPUTS, before.position, before.velocity)

    def _roll_back(self) -> None:
        assert self._batch_start is not None
        self._restore_motion(self._batch_start)

    def _take_work(self) -> float:
        """Return the work of air, colliders and grippers since the last call, J; inf: unknown."""
        return self._kick_drift.take_work() + self.interactions.take_work()

    def _run(
        self, kick_drift: KickDrift, steps: Steps, count: int, h: float, division: int
    ) -> Iterator[None]:
        """Make so many substeps, and pause after each batch of step control."""
        control = self.step_control
        airspeed = math.hypot(*self._air_velocity)
        try:
            while count > 0:
                # With a pin the sheet cannot move away, and the pin must not move by one bit.
                if not self._pinned:
                    self.state.recenter_origin(2 * self.scene.sheet.diagonal or 1.0)
                most = control.check_interval(self.state, h)
                most = self.interactions.longest_part(self.state, count, h, most)
                # The shortest batches are whole: dissipation acts once in each of them.
                substeps = min(count, most) if most <= CHECK_INTERVAL else part(count, most)
                count -= substeps
                for batch in control.batches(self.state, substeps, h, division, airspeed):
                    self.substeps += batch.substeps
                    self._apply(kick_drift, steps(batch), batch.substeps * batch.h)
                    yield
        except BaseException:  # an interrupt, or the caller closes this iteration within a batch
            if self._monitor is not None and self._batch_start is not None:
                self._roll_back()
            raise

    def _apply(self, kick_drift: KickDrift, steps: tuple[Step, ...], seconds: float) -> None:
        """Make kicks and drifts that last for `seconds`, with all that acts on the sheet."""
        self.interactions.apply(
            kick_drift, self.state, steps, seconds, self._air_velocity, self.time, self._observer
        )
        self.time += seconds

    def _damped(self, h: float) -> KickDrift:
        """
        Return the kicks of the integrator whose energy cannot grow, for substeps of `h` s.

        What divides them further, by n, leaves enough drag: (1 − q)^(1/n) ≤ 1 − q/n².
        """
        elastic, _ = rate_bounds(self.scene)
        drag = DampedEuler.drag(h / (DAMPED_DIVISION * self.step_control.division), elastic)
        return KickDrift(
            self.scene, self.grid, self.state.dtype, extra_drag=drag, **self.interactions.in_kernel
        )

    # Compilation

    def warm_up(self) -> None:
        """Compile the kernels of motion, without contact."""
        self.step_control.begin(self.state, self.time)
        self._idle(1)
        max_speed(self.state)
        self.interactions.warm_up(self.state)
        self._kick_drift.warm_up_sweeps(self.state)
        if self._monitor is not None:
            self._monitor.begin_batch(self.state)

    def time_substep(self) -> float:
        """Return the wall-clock time of a substep without contact, s."""
        self.warm_up()
        return min(self._idle(_TIMED) for _ in range(3)) / _TIMED

    def _idle(self, count: int) -> float:
        """Make `count` substeps without motion; return the wall-clock time, s."""
        (batch, *_) = self.step_control.batches(
            self.state, count, self.step_control.substep, 1, 0.0
        )
        steps = tuple([step._replace(drift=0.0) for step in self._integrator.steps(batch)])
        return self._kick_drift.time_without_effect(self.state, steps, self._air_velocity)

    def warm_up_contact(self) -> None:
        """Compile the kernels of contact, so that the first contact causes no pause."""
        self.interactions.warm_up_contact(self._kick_drift, self.state, self.time)
