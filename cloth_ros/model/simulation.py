"""
A simulation: the state of a scene, carried through time.

An advance is cut where the air changes, and then into stretches of substeps, after each of which
the `guard` looks at the energy.  A stretch is given to the integration method in blocks, before
each of which the speed of the cloth is looked at, and between whose substeps the sphere acts where
it is near.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np

from ..scene import Scene
from ..scene.parameter import ParameterSpec, checked_number, convert, invalid_value_error
from . import memory
from .contact import sphere_collider
from .contact.kinematic_path import CommandedMotion
from .contact.sphere_collider import Placing, SphereCollider
from .energy_monitor import BATCH, DAMPED_DIVISION, DIVISIONS, EnergyMonitor, RollbackCounts
from .forces.gusts import Gusts
from .grid import Array, Grid
from .integrators import Integrator
from .integrators.damped_euler import DampedEuler
from .integrators.integrator import KickDriftIntegrator, SubstepBatch
from .integrators.kick_drift import KickDrift
from .state import State, max_speed
from .time_step import (
    CHECK_INTERVAL,
    ROUNDING,
    dissipation_interval,
    integrator_for,
    precision_for,
    substep_division,
    substep_length,
)

_DTYPES = {'single': np.float32, 'double': np.float64}

_LONGEST = 1e6  # s, of one advance
_FINER = ParameterSpec('divides every substep', low=1, high=1000)
_TIMED = CHECK_INTERVAL  # substeps to tell their cost from
# Share by which substeps may differ and be made alike: times are rounded, and each other length
# would have its own tables.
_ALIKE = 1e-8


def require_scene(scene: object) -> None:
    """Raise ValueError for what is no scene."""
    if not isinstance(scene, Scene):
        raise invalid_value_error(
            'scene', scene, 'a cloth_ros.Scene', 'use Scene(...) or Scene.from_yaml'
        )


class Simulation:
    """
    What advances; its parameters are those of a `Cloth`.

    Attributes
    ----------
    guarded
        True to look at the energy after each stretch, and to repeat what was no good; a study of
        how a method fails must do without.

    """

    monitored = True

    def __init__(self, scene: Scene, *, finer: int = 1) -> None:
        require_scene(scene)
        memory.check(scene, memory.of_cloth(scene))
        self._finer: int = convert('finer', finer, 1, _FINER)
        self._look = (
            CHECK_INTERVAL if self._finer == 1 else 1
        )  # twins run in pauses, which are short
        self._grid_layout = Grid(scene.sheet.rows, scene.sheet.columns)
        self._state = State(self._grid_layout, _DTYPES[precision_for(scene)])
        self._wind = np.zeros(3)
        self._air = np.zeros(3)
        self._contact: SphereCollider | None = None
        self._rollbacks = RollbackCounts()
        self._time = 0.0
        self._substeps = 0
        self._done = 0.0
        self._sphere = CommandedMotion(scene.sphere.position)
        self._build(scene)

    def _build(self, scene: Scene) -> None:
        """Make what a scene requires, around the present state."""
        self._scene = scene
        dtype = _DTYPES[precision_for(scene)]
        if self._state.dtype is not dtype:
            former, self._state = self._state, State(self._grid_layout, dtype)
            self._state.copy_from(former)
        pinned = scene.pinned()
        self._pinned = bool(pinned.any())
        self._state.pin(pinned)
        self._gusts = Gusts(scene.wind.gust) if scene.wind.gust.period > 0 else None
        before, self._contact = self._contact, None
        if scene.sphere.radius > 0:
            centre, gravity = self._sphere.centre, np.array(scene.gravity)
            self._contact = SphereCollider(scene.sphere, self._grid_layout, centre, gravity)
            if before is not None:
                self._contact.go_on_from(before)
        else:
            self._sphere.waypoints = []
        self._kick_drift = KickDrift(scene, self._grid_layout, self._air, dtype)
        self._method = integrator_for(scene)(self._kick_drift)
        self._substep = substep_length(scene)
        self._stability_limit = scene.stability_limit()
        self._elastic, self._viscous = scene.rate_bounds()
        self._energy_monitor = EnergyMonitor(scene, dtype, self._rollbacks)

    @property
    def scene(self) -> Scene:
        """The scene that is simulated."""
        return self._scene

    @property
    def time(self) -> float:
        """Simulated time since the start or the last reset, s."""
        return self._time

    @property
    def stability_limit(self) -> float:
        """Longest stable substep, s, for every state of the cloth; inf without springs."""
        return self._stability_limit

    @property
    def substep(self) -> float:
        """Length of the substeps, s; a whole number of them makes a tick of the scene's rate."""
        return self._substep

    @property
    def substeps(self) -> int:
        """Number of substeps of the last advance, those of violent motion included."""
        return self._substeps

    @property
    def work(self) -> float:
        """
        Most work, J, that air and sphere can have done since the start or the last reset.

        The energy of the cloth is never more than what it had, and this, but for a tolerance.
        """
        return self._done

    @property
    def rollbacks(self) -> RollbackCounts:
        """What the guard has had to repeat since the cloth was made, see `guard`."""
        return self._rollbacks

    def advance(self, seconds: float) -> None:
        """
        Simulate the next `seconds`, in equal substeps no longer than `substep`.

        Fast motion divides them further, see `substeps.refinement`, and so does the guard where
        energy came from nowhere.

        Raises
        ------
        ValueError
            `seconds` is negative, not finite, or more than a million.

        """
        for _ in self.advance_stepwise(seconds):
            pass

    def advance_stepwise(self, seconds: float) -> Iterator[None]:
        """
        Advance as `advance` does, but pause after each substep for whoever iterates.

        The cloth must be left alone until the iteration is over or closed; positions and
        velocities do not belong to one time before.  Closed half-way, it ends with the last
        stretch of substeps that was whole.
        """
        return self._march(checked_number('seconds', seconds, 0.0, _LONGEST, 's'))

    def _march(self, seconds: float) -> Iterator[None]:
        if self._time + seconds == self._time:  # nothing, or less than what time resolves
            return
        if self._contact is not None:
            if self._sphere.jump(seconds):
                self._respawn()
            self._contact.place(self._sphere.centre)
            self._sphere.begin(self._time, seconds)
        self._substeps = 0
        try:
            yield from self._stretches(seconds)
        except BaseException:  # given up half-way: so is the path of the sphere
            if self._contact is not None:
                self._sphere.centre = self._contact.centre
            raise
        if self._contact is not None:
            self._sphere.end()

    def _stretches(self, seconds: float) -> Iterator[None]:
        """Simulate stretch after stretch, cut where the air changes."""
        end = self._time + seconds
        while self._time < end:
            begin, change = self._time, end
            self._air[:] = self._wind
            if self._gusts is not None:
                change = min(end, self._gusts.next_change(begin))
                self._air += self._gusts.velocity(0.5 * (begin + change))
            count = max(math.ceil((change - begin) / self.substep - ROUNDING), 1)
            h = (change - begin) / count
            if abs(h - self.substep) <= _ALIKE * self.substep:
                h = self.substep
            for first in range(0, count, BATCH):
                yield from self._stretch(min(BATCH, count - first), h)
            self._time = change

    def _stretch(self, count: int, h: float) -> Iterator[None]:
        """Make so many substeps, and again in the ways of `guard` if they were no good."""
        if not self.monitored:
            yield from self._run(self._method, count, h, 1)
            return
        guard, method = self._energy_monitor, self._method
        guard.open(self._state)
        self._begin = self._mark()
        for division in DIVISIONS:
            if division < guard.division:
                continue
            if division > guard.division:
                self._go_back()
                guard.divide(division)
            yield from self._run(method, count, h, division)
            touched = self._contact is not None and self._contact.touched
            work = self._take_work()
            if self._accept(work, touched=touched):
                return
        if guard.limit(self._state, work) and self._accept(work):
            return
        self._go_back()
        guard.rollbacks.damped += 1
        yield from self._run(self._damped(h), count, h, DAMPED_DIVISION)
        if self._accept(self._take_work()):
            return
        self._go_back()
        guard.rollbacks.held += 1
        self._state.velocity[...] = 0
        self._moved(count * h)
        self._take_work()
        if not self._accept(math.inf):  # not even contact alone, from rest
            self._go_back()
            self._state.velocity[...] = 0
            self._time += count * h
            self._accept(math.inf)

    def _accept(self, work: float, *, touched: bool = False) -> bool:
        """Take the state for good if the guard does."""
        accepted = self._energy_monitor.accepts(self._state, work, touched=touched)
        if accepted:
            self._done += self._energy_monitor.work
        return accepted

    def _run(
        self, method: Integrator | KickDriftIntegrator, count: int, h: float, division: int
    ) -> Iterator[None]:
        blocks = self._blocks(count, h, division)
        try:
            yield from method.run(self._state, blocks, self._moved, self._watched)
        except BaseException:  # Ctrl-C, or whoever iterates has closed: within a substep
            if self.monitored and self._energy_monitor.has_state:
                self._go_back()
            raise

    def _damped(self, h: float) -> KickDriftIntegrator:
        """
        Return the method whose energy cannot grow, for substeps of `h` s before division.

        What divides them further, by n, leaves enough drag: (1 − q)^(1/n) ≤ 1 − q/n².
        """
        drag = DampedEuler.drag(h / (DAMPED_DIVISION * self._finer), self._elastic)
        dtype, scene = self._state.dtype, self._scene
        return DampedEuler(KickDrift(scene, self._grid_layout, self._air, dtype, more_drag=drag))

    def _respawn(self) -> None:
        """Have the sphere be where it is told to, as large as the sheet leaves room for."""
        if self._contact is not None:
            self._contact.centre = self._sphere.centre
            self._contact.respawn()
            self._contact.shrink_to_fit(self._state)

    def _mark(self) -> tuple[float, Placing | None]:
        """Return the time, and where and how large the sphere is."""
        return self._time, None if self._contact is None else self._contact.placing

    def _go_back(self) -> None:
        """Return to the last good state, and to what was marked with it."""
        self._energy_monitor.go_back(self._state)
        self._take_work()
        self._time, placing = self._begin
        if self._contact is not None and placing is not None:
            self._contact.go_back(placing)

    def _take_work(self) -> float:
        """Return the work of air and sphere since the last call, J; inf: any."""
        work = self._kick_drift.take_work()
        if self._contact is not None:
            work += self._scene.sheet.particle_mass * self._contact.take_work()
        return work

    def _watched(self, block: SubstepBatch) -> bool:
        """Tell if the sphere may act on the sheet between two substeps of a block."""
        if self._contact is None:
            return False
        return not self._contact.is_clear(
            self._state, block.substeps * block.h, self._sphere.speed
        )

    def _blocks(self, count: int, h: float, division: int) -> Iterator[SubstepBatch]:
        """Yield the blocks of `count` substeps, in which the air does not change."""
        for first in range(0, count, self._look):
            self._follow()
            speed = max_speed(self._state)
            fine = division * self._finer * substep_division(self._scene, h, speed)
            airspeed = speed + float(np.linalg.norm(self._air))
            spacing = self._spacing(h / fine, airspeed)
            for _ in range(fine):
                part = min(self._look, count - first)
                self._substeps += part
                yield SubstepBatch(part, h / fine, spacing)

    def _spacing(self, substep: float, airspeed: float) -> int:
        """Return in how many substeps dissipation acts once."""
        if self._state.dtype is np.float64:
            return 1
        return dissipation_interval(self._scene, substep, self._viscous, airspeed)

    def _follow(self) -> None:
        # With a pin the sheet cannot stray, and the pin must not move by one bit.
        if not self._pinned:
            self._state.follow(2 * self._scene.sheet.diagonal or 1.0)

    def _moved(self, h: float) -> None:
        """Let the sphere, on its path, act on particles that have drifted for `h` s."""
        if self._contact is not None:
            self._contact.velocity = self._sphere.velocity(self._time, h)
            self._contact.resolve(self._state, h)
        self._time += h

    def _gust(self) -> Array:
        return np.zeros(3) if self._gusts is None else self._gusts.velocity(self._time)

    def _forget(self) -> None:
        """Take the present state as it is: it was set from outside."""
        self._energy_monitor.forget()
        self._take_work()
        if self._contact is not None:
            self._contact.invalidate()

    def warm_up(self) -> Iterator[str]:
        """Compile what the scene uses, and say before each kernel what it is for."""
        yield 'motion'
        self._idle(1)
        max_speed(self._state)
        self._energy_monitor.open(self._state)
        if self._contact is not None:
            yield 'contact'
            sphere_collider.warm_up(self._state.dtype)

    def compile(self) -> float:
        """Warm up, and return the wall-clock time of a substep without contact, s."""
        list(self.warm_up())
        return min(self._idle(_TIMED) for _ in range(3)) / _TIMED

    def _idle(self, count: int) -> float:
        """Make `count` substeps of no length; return the wall-clock time, s, that they took."""
        position, velocity = self._state.position.copy(), self._state.velocity.copy()
        spacing = self._spacing(self.substep, 0.0)
        blocks = [SubstepBatch(count, 0.0, spacing)]
        start = time.perf_counter()
        for _ in self._method.run(self._state, blocks, lambda _: None, lambda _: False):
            pass
        seconds = time.perf_counter() - start
        self._kick_drift.take_work()
        self._state.position[...], self._state.velocity[...] = position, velocity
        return seconds
