"""One run of a scene: where its particles were, what its energy was, and what it cost."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..model import Cloth
from ..model.lattice import Array


@dataclass(frozen=True)
class Course:
    """
    What happens in a run, the same for every setting.

    Attributes
    ----------
    seconds, period
        Simulated time, and time from one sample to the next, s.
    start
        The cloth in the state that it begins with; None: the initial state.
    goal, arrival
        Where the sphere is sent at constant speed, m, and how long it takes, s; None: nowhere.

    """

    seconds: float
    period: float
    start: Cloth | None = None
    goal: tuple[float, float, float] | None = None
    arrival: float = 1.0

    @property
    def samples(self) -> int:
        """Number of samples, the state at the beginning not among them."""
        return round(self.seconds / self.period)

    @property
    def times(self) -> Array:
        """Times of the samples since the beginning, s, shape (samples,)."""
        return np.arange(1, self.samples + 1) * self.period

    @property
    def key(self) -> list[object]:
        """What tells this course from others."""
        begins = self.start.time if self.start is not None else 0.0
        return [self.seconds, self.period, begins, self.goal, self.arrival]

    def begin(self, cloth: Cloth) -> None:
        """Bring a cloth of the scene into the state at the beginning."""
        cloth.reset()
        if self.start is not None:
            cloth.adopt(self.start)

    def command(self, cloth: Cloth, origin: Sequence[float], until: float) -> None:
        """Send the sphere, which set out from `origin`, to where it is at `until` s."""
        if self.goal is not None:
            share = min(until / self.arrival, 1.0)
            goal = np.array(self.goal)
            cloth.move_sphere((np.array(origin) + share * (goal - origin)).tolist())


@dataclass
class Run:
    """
    What came out of a run.

    Attributes
    ----------
    positions
        m, shape (samples, rows, columns, 3); shorter where the run was given up.
    energy, strain
        Kinetic and elastic energy together with the gravitational, J, and largest strain, at
        each sample.
    motion
        Kinetic and elastic energy, J, at each sample.
    substeps
        In the whole run.
    wall, seconds
        Wall-clock time spent in `Cloth.advance`, and simulated time that it was asked for, s.
    finite
        False if the run ended in a state that was not finite.

    """

    positions: Array
    energy: list[float] = field(default_factory=list)
    motion: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    substeps: int = 0
    wall: float = 0.0
    seconds: float = 0.0
    finite: bool = True


def simulate(cloth: Cloth, course: Course, wildest: float = math.inf) -> Run:
    """
    Run a cloth through a course, tick by tick.

    Parameters
    ----------
    cloth
        It is brought to the beginning first.
    course
        What happens.
    wildest
        Kinetic and elastic energy, J, from which on the run is given up: it has blown up.

    """
    course.begin(cloth)
    origin = cloth.sphere_position
    ticks = round(course.period * cloth.scene.rate)
    sheet = cloth.scene.sheet
    run = Run(np.empty((course.samples, sheet.rows, sheet.columns, 3)))
    for sample in range(course.samples):
        for number in range(ticks):
            course.command(cloth, origin, (sample + (number + 1) / ticks) * course.period)
            run.seconds += course.period / ticks
            before = time.perf_counter()
            try:
                cloth.advance(course.period / ticks)
            except FloatingPointError:
                run.finite = False
            run.wall += time.perf_counter() - before
            run.substeps += cloth.substeps
            energy = cloth.energy_by_kind()
            if not run.finite or energy.kinetic + energy.elastic > wildest:
                run.positions = run.positions[:sample]
                return run
        run.positions[sample] = cloth.positions
        run.energy.append(energy.total)
        run.motion.append(energy.kinetic + energy.elastic)
        run.strain.append(cloth.largest_strain())
    return run
