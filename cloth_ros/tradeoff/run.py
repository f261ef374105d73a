"""One run of a scene: where its particles were, what its energy was, and what it cost."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..model import Cloth
from ..model.grid import Array
from ..scene import Scene


@dataclass(frozen=True)
class Scenario:
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

    def ticks(self, cloth: Cloth) -> Iterator[float]:
        """
        Bring a cloth of the scene to the beginning, then yield tick after tick.

        Yields the length of a tick, s, with the sphere told where to go in it; the cloth is to be
        advanced by that before the next.
        """
        cloth.reset()
        if self.start is not None:
            cloth.adopt(self.start)
        origin, tick = np.array(cloth.sphere_position), 1 / cloth.scene.rate
        for number in range(1, round(self.seconds / tick) + 1):
            if self.goal is not None:
                share = min(number * tick / self.arrival, 1.0)
                cloth.move_sphere((origin + share * (np.array(self.goal) - origin)).tolist())
            yield tick


def start_of(scene: Scene, begins: float) -> Cloth | None:
    """Return a cloth at the time `begins`, s; None for the initial state."""
    if begins == 0:
        return None
    cloth = Cloth(scene)
    cloth.advance(begins)
    return cloth


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

    """

    positions: Array
    energy: list[float] = field(default_factory=list)
    motion: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    substeps: int = 0
    wall: float = 0.0
    seconds: float = 0.0


def simulate(cloth: Cloth, scenario: Scenario, wildest: float = math.inf) -> Run:
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
    each = round(scenario.period * cloth.scene.rate)
    sheet = cloth.scene.sheet
    run = Run(np.empty((scenario.samples, sheet.rows, sheet.columns, 3)))
    for number, tick in enumerate(scenario.ticks(cloth)):
        run.seconds += tick
        before = time.perf_counter()
        cloth.advance(tick)
        run.wall += time.perf_counter() - before
        run.substeps += cloth.substeps
        energy = cloth.energy_by_kind()
        sample = number // each
        if not energy.motion <= wildest:  # NaN is no energy
            run.positions = run.positions[:sample]
            return run
        if (number + 1) % each == 0:
            run.positions[sample] = cloth.positions
            run.energy.append(energy.total)
            run.motion.append(energy.kinetic + energy.elastic)
            run.strain.append(cloth.largest_strain())
    return run
