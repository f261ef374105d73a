"""One run of a scene: positions, energies and stretch of its samples, and its cost."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..model import Cloth, Snapshot
from ..model.contact.closest_point import closest_point
from ..model.grid import Array
from ..model.kernels.jit import exact
from ..scene import Scene

# Up to this multiple of the radius and this gap, m, a sheet counts as touching the sphere: lying
# on it, it moves a little.
_TOUCHING, _GAP = 1.01, 1e-4


@dataclass(frozen=True)
class Scenario:
    """
    Start, duration and inputs of a run, the same for every setting.

    Attributes
    ----------
    seconds, period
        Simulated time, and time between samples, s.
    start
        State to begin with; None: the initial state of the scene.
    goal, arrival
        Position that the sphere moves to at constant speed, m, and the time that it takes, s;
        None: the sphere stays.

    """

    seconds: float
    period: float
    start: Snapshot | None = None
    goal: tuple[float, float, float] | None = None
    arrival: float = 1.0

    @property
    def samples(self) -> int:
        """Number of samples, without the state at the start."""
        return round(self.seconds / self.period)

    @property
    def times(self) -> Array:
        """Times of the samples since the start, s, shape (samples,)."""
        return np.arange(1, self.samples + 1) * self.period

    @property
    def key(self) -> list[object]:
        """What identifies this scenario in the cache."""
        begins = self.start.time if self.start is not None else 0.0
        return [self.seconds, self.period, begins, self.goal, self.arrival]

    def ticks(self, cloth: Cloth) -> Iterator[float]:
        """
        Set a cloth of the scene to the start, then yield the length of each tick, s.

        The sphere has been given its next waypoint; the caller is to advance the cloth by the
        tick before it asks for the next one.
        """
        cloth.reset()
        if self.start is not None:
            cloth.restore(self.start)
        origin, tick = np.array(cloth.sphere_position), 1 / cloth.scene.rate
        for number in range(1, round(self.seconds / tick) + 1):
            if self.goal is not None:
                share = min(number * tick / self.arrival, 1.0)
                cloth.move_sphere((origin + share * (np.array(self.goal) - origin)).tolist())
            yield tick


def state_at(scene: Scene, begins: float) -> Snapshot | None:
    """Return the state of a scene at the time `begins`, s; None for the initial state."""
    if begins == 0:
        return None
    cloth = Cloth(scene)
    cloth.advance(begins)
    return cloth.snapshot()


@exact
def _squared_distance(points, rows, columns):  # type: ignore[no-untyped-def]
    """Return the squared distance, m², of a sheet from the origin; a cell is four triangles."""
    least = np.inf
    down, across = min(rows - 1, 1) * columns, min(columns - 1, 1)
    for row in range(max(rows - 1, 1)):
        for column in range(max(columns - 1, 1)):
            a = row * columns + column
            b, c, d = a + across, a + down, a + down + across
            for corners in ((a, b, c), (b, c, d), (a, b, d), (a, c, d)):
                least = min(least, closest_point(points, *corners)[0])
    return least


def touches_sphere(cloth: Cloth) -> bool:
    """Return whether the sheet touches the sphere."""
    radius, sheet = cloth.scene.sphere.radius, cloth.scene.sheet
    if radius == 0:
        return False
    if cloth.colliders['sphere'].touching:
        return True
    points = (cloth.positions - np.array(cloth.sphere_position)).reshape(-1, 3)
    distance = math.sqrt(_squared_distance(points, sheet.rows, sheet.columns))
    return distance <= _TOUCHING * radius + _GAP


@dataclass
class Run:
    """
    Result of a run.

    Attributes
    ----------
    positions
        m, shape (samples, rows, columns, 3); shorter where the run was stopped.
    energy, stretch
        Sum of kinetic, elastic and gravitational energy, J, and largest stretch, at each sample.
    motion
        Kinetic and elastic energy, J, at each sample.
    contact
        Time of the first sample at which the sheet touches the sphere, s; None: it never does.
    substeps
        Of the whole run.
    wall, seconds
        Wall-clock time spent in `Cloth.advance`, and the simulated time advanced, s.

    """

    positions: Array
    energy: list[float] = field(default_factory=list)
    motion: list[float] = field(default_factory=list)
    stretch: list[float] = field(default_factory=list)
    contact: float | None = None
    substeps: int = 0
    wall: float = 0.0
    seconds: float = 0.0


def simulate(cloth: Cloth, scenario: Scenario, blow_up: float = math.inf) -> Run:
    """
    Run a cloth through a scenario, tick by tick.

    Parameters
    ----------
    cloth
        It is set to the start first.
    scenario
        Start, duration and inputs.
    blow_up
        Kinetic and elastic energy, J, at which the run is stopped: it is unstable.

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
        if not energy.motion <= blow_up:  # NaN too
            run.positions = run.positions[:sample]
            return run
        if (number + 1) % each == 0:
            run.positions[sample] = cloth.positions
            run.energy.append(energy.total)
            run.motion.append(energy.motion)
            run.stretch.append(cloth.strain().stretch)
            if run.contact is None and touches_sphere(cloth):
                run.contact = run.seconds
    return run
