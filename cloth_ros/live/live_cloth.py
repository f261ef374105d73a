"""
A cloth that runs in real time: the model with pacing, overload handling and an error estimate.

Call `tick` at each tick of a clock, publish the state, and then call `estimate_error`, which uses
time that is left over.  `configure` requests other parameters; they take effect as soon as their
kernels are there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from ..model import Snapshot, check_scene
from ..model.contact.collider import Collider
from ..model.energy_monitor import RollbackCounts
from ..model.grid import Array
from ..model.grippers.gripper import Gripper
from ..scene import Scene
from .body_commands import BodyCommands
from .error_estimate import ErrorEstimator, fine_in_background
from .first_start import FirstStart
from .kernel_compiler import KernelCompiler, Log
from .keyframe import Keyframe, keyframe_of
from .overload import OVERLOADED
from .pacing import Pacing
from .plausibility_log import PlausibilityLog
from .reconfiguration import Change, Reconfiguration
from .report import Report, measured_values
from .slow_motion import SlowMotion
from .solver_summary import solver_summary
from .tick_record import TickRecorder

# Share of a core for the error estimate; with its bookkeeping it takes 5 %.
_ESTIMATE_SHARE = 0.045
_LONGEST_PAUSE = 1.0  # s, of which that share is spent at most

Vector = tuple[float, float, float]


class LiveCloth:
    """
    A running cloth.

    Parameters
    ----------
    scene
        What to simulate.
    log
        Where to report what happens: a `logging.Logger`, or that of a ROS node.

    Attributes
    ----------
    running
        True once the kernels of motion are there.
    paused
        True while time does not pass; assign to pause and resume.
    revision
        Counts the changes of the state.
    replaced
        Counts those by a reset or a snapshot: commands of before are then undone.
    record
        Collects what acts on the cloth in each tick.
    bodies
        Commands to colliders and grippers.

    Raises
    ------
    ValueError
        The scene cannot be simulated.

    """

    def __init__(self, scene: Scene, log: Log) -> None:
        self._log = log
        check_scene(scene)
        self._plausibility = PlausibilityLog(log)
        self._plausibility.check(scene)
        self._compiler = KernelCompiler(log)
        self._start = FirstStart(scene, self._compiler, log)
        self._published = self._start.initial_cloth()
        self._changes = Reconfiguration(scene, self._compiler, log)
        self._pacing, self._slow_motion = Pacing(), SlowMotion()
        self._usual_cost = 0.0
        self._substeps = 0
        make_fine = partial(fine_in_background, self._compiler, self._start.label)
        self._estimator = ErrorEstimator(self._published.cloth, make_fine=make_fine)
        self._estimating = False
        self._rollbacks = RollbackCounts()
        self._may_change = True
        self._summary_due = False
        self.record = TickRecorder()
        self.bodies = BodyCommands(
            lambda: self._published.cloth, self._change_scene, self._changes
        )
        self._to_restore: Snapshot | None = None
        self.running = False
        self.paused = False
        self.revision = self.replaced = 0
        self.poll()

    def close(self) -> None:
        """End all background work."""
        self._compiler.close()

    # State

    @property
    def scene(self) -> Scene:
        """The scene that is simulated; its sheet has the grid that is published."""
        return self._published.scene

    @property
    def requested(self) -> Scene:
        """The scene that was last requested."""
        return self._changes.requested

    @property
    def pending(self) -> float:
        """Time that has passed but is not simulated yet, s; the state is as old as that."""
        return self._pacing.pending

    @property
    def reduction(self) -> str:
        """What is given up because of overload, in words; empty if nothing is."""
        return self._changes.reduction

    @property
    def air_velocity(self) -> Vector:
        """Velocity of the air now, gusts included, m/s."""
        return self._published.air_velocity

    @property
    def colliders(self) -> Mapping[str, Collider]:
        """Colliders by name."""
        return self._published.colliders

    @property
    def grippers(self) -> Mapping[str, Gripper]:
        """Grippers by name."""
        return self._published.grippers

    def write_particles(self, out: Array) -> None:
        """Write x y z vx vy vz of every particle, m and m/s, to `out`, (rows, columns, 6)."""
        self._published.write_particles(out)

    def write_positions(self, out: Array) -> None:
        """Write the position of every particle, m, to `out`, shape (rows, columns, 3)."""
        self._published.write_positions(out)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._published.cloth.time

    def keyframe(self, tick: int, stamp: int) -> Keyframe:
        """Return the exact state after a tick of that number, stamped in ns."""
        now = self._published
        return keyframe_of(now.cloth, now.scene, now.spacing, tick, stamp)

    # Commands

    def configure(self, scene: Scene) -> None:
        """
        Request other parameters.

        However often they change, they take effect once a tick, unless a command comes between.
        """
        self._plausibility.check(scene)
        self._changes.requested = scene
        if self._may_change:
            self._change_scene()

    def set_wind(self, velocity: Sequence[float]) -> None:
        """Set the velocity of the air, m/s; raises ValueError."""
        self._change_scene()  # parameters that were set before the command hold for it
        self._published.cloth.wind = velocity

    def reset(self) -> None:
        """Return to the initial state."""
        self._to_restore = None
        self._change_scene()
        self._published.cloth.reset()
        self.record.reset()
        self._state_replaced()

    def snapshot(self) -> Snapshot:
        """Return the state for the scene that is in effect, on the grid that is published."""
        return self._published.snapshot(self._changes.overload.requested)

    def restore(self, snapshot: Snapshot) -> bool:
        """
        Return to a snapshot as soon as the requested scene is simulated.

        Returns True if it is now; False if kernels are being compiled first.
        """
        self._to_restore, self._may_change = snapshot, True
        self._change_scene()
        return self._to_restore is None

    def _state_replaced(self) -> None:
        self._estimator.restart()
        self._pacing.discard()
        self._start.release()
        self.revision += 1
        self.replaced += 1

    # Time

    def tick(
        self,
        elapsed: float,
        *,
        period: float,
        wall: float,
        estimate_error: bool = False,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> bool:
        """
        Simulate what is due.

        Parameters
        ----------
        elapsed
            Time since the last tick, s, by the clock that the cloth follows.
        period
            Usual time between two ticks, s.
        wall
            Wall-clock time that the tick may take, s.
        estimate_error
            True if the error estimate is wanted; the first one is always made.
        interrupted
            Called between batches of substeps; if it returns True, the tick ends at once.

        Returns
        -------
        bool
            False if it was interrupted: there is no state to publish.

        """
        self.poll()
        self._may_change = True
        self._change_scene()
        wanted = estimate_error or self._estimator.estimate is None
        self._estimating = wanted and self._published.spacing == 1 and not self._start.missing
        if self.paused:
            self._pacing.discard()
            return True
        cloth, pacing = self._published.cloth, self._pacing
        substep, lost = cloth.substep, pacing.lost
        max_tick = self.scene.solver.max_tick
        count = pacing.due(elapsed, substep, period, max_tick, wall)
        if count == 0:
            return True
        self.revision += 1
        start, cpu = time.perf_counter(), time.thread_time()
        if self._estimating:
            self._estimator.observe(count * substep)
        if not self._advance(count * substep, interrupted):
            return False
        if self._start.held:
            pacing.discard()
            return True
        wall, cpu = time.perf_counter() - start, time.thread_time() - cpu
        pacing.done(count, substep, wall, cpu)
        self._substeps += cloth.substeps
        if pacing.lost > lost:
            self._changes.relax(pacing.cost)
        return True

    def step(self, interrupted: Callable[[], bool] = lambda: False) -> bool:
        """Simulate one tick while paused; False if interrupted, ValueError if held or running."""
        if not self.paused:
            raise ValueError('the cloth is not paused; pause it, then step')
        self.poll()
        self._may_change = True
        self._change_scene()
        if not self._advance(1 / self.scene.rate, interrupted):
            return False
        if self._start.held:
            raise ValueError(f'the cloth is held: {self._start.held}; step again later')
        self.revision += 1
        return True

    def _advance(self, seconds: float, interrupted: Callable[[], bool]) -> bool:
        """Advance, and record that, unless the cloth is held; return False if interrupted."""
        cloth = self._published.cloth
        inputs = cloth.inputs
        for _ in self._start.advance(cloth, seconds):
            if interrupted():
                return False
        if not self._start.held:
            self.record.advanced(inputs, seconds, cloth.substep)
        return True

    def estimate_error(self, wall: float) -> None:
        """Work on the error estimate for a share of `wall`, s, of wall-clock time."""
        if self._estimating and not self.paused:
            self._estimator.work(_ESTIMATE_SHARE * min(wall, _LONGEST_PAUSE))

    def poll(self) -> None:
        """Check whether kernels have become available; `tick` does so as well."""
        self._start.poll()
        if not self.running and 'motion' not in self._start.missing:
            self._begin()

    def _begin(self) -> None:
        """Measure the cost of a substep of a new cloth or scene."""
        self.running = True
        cloth = self._published.cloth
        self._usual_cost = cloth.time_substep()
        self._pacing.expect(self._usual_cost)
        if not self._changes.reduction and self._usual_cost > OVERLOADED * cloth.substep:
            text = self._slow_motion.advice(cloth.scene, self._usual_cost)
            self._log.warning(f'too slow for real time: {text}')

    def _change_scene(self) -> None:
        """Make a change that was requested, or that overload requires, once it is ready."""
        change = self._changes.poll()
        if change is not None:
            self._make(change)
        if self._to_restore is None or self._start.missing:
            return
        snapshot = self._to_restore
        if self._changes.failed:  # the log says why
            self._to_restore = None
            self._log.error('the saved state is not restored')
        elif self._changes.settled:
            self._to_restore = None
            self._published.cloth.restore(snapshot)
            self.record.restored()
            self._state_replaced()
            self._log.info(f'a saved state is restored: simulated time {self.time:.6g} s')

    def _make(self, change: Change) -> None:
        level = change.level
        self._published = self._published.changed(level.scene, level.spacing)
        self.record.configured(level.scene, level.spacing)
        self._start.abandon()
        self._begin()
        self._estimator.restart(self._published.cloth)
        if change.requested:
            self._may_change, self._summary_due = False, True
        else:
            self._log.warning(f'overload, {level.text}: {self.solver_summary}')

    # Reports

    @property
    def solver_summary(self) -> str:
        """One line about the solver, for people."""
        cloth = self._published.cloth
        return solver_summary(cloth, self._pacing.load(cloth.substep))

    def take_report(self) -> Report:
        """
        Return how the cloth has run since the last report; to be called once a second.

        Reduced accuracy is restored here, one level at a time, when no time was lost.
        """
        if self._summary_due:
            self._summary_due = False
            self._log.info(self.solver_summary)
        pacing, rollbacks = self._pacing.take_report(), self._published.cloth.rollbacks
        since, self._rollbacks = rollbacks.since(self._rollbacks), replace(rollbacks)
        cause = ''
        if pacing.lost == 0:
            self._changes.recover(self._pacing.cost)
        else:
            division = self._substeps / pacing.substeps if pacing.substeps else 1.0
            requested, simulated = self._changes.overload.requested, self._published.cloth.scene
            cause = self._slow_motion.explain(
                requested, simulated, self._usual_cost, pacing, division
            )
        self._substeps = 0
        return Report(
            real_time_factor=pacing.real_time_factor,
            lost=pacing.lost,
            cause=cause,
            waiting=pacing.wall - pacing.cpu,
            rollbacks=since,
            held=self._start.held,
            reduction=self._changes.reduction,
        )

    def values(self) -> dict[str, object]:
        """Return measured values by name and unit; takes as long as some substeps."""
        cloth = self._published.cloth
        return measured_values(cloth, self._pacing.load(cloth.substep), self._estimator.report())
