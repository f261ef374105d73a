"""Plan of a study of a scene: its settings, its scenario, and the expected cost of each run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ..model import Cloth
from ..model.integrators import INTEGRATORS
from ..model.time_step import substep_length
from ..scene import Scene
from .cache import Cache
from .machine import describe
from .reference_solution import reference_setting
from .run import Scenario, simulate, state_at
from .settings import Setting, plan, rates

# Simulated time, s, and wall-clock time of the first runs of all settings, s, that a study of one
# scene aims at.
_SECONDS = 1.0
_BUDGET = {True: 30.0, False: 200.0}
# Number of runs of a setting, for the median of its cost, and the cost of a run, s, above which
# there are two only.
_REPEATS = {True: 3, False: 5}
_REPEATED = {True: 1.0, False: 4.0}
# Substeps of the reference's first level as a multiple of the finest setting's, and the number of
# times that they are doubled at most.
_MARGIN = 4
_DOUBLINGS = {True: 1, False: 2}
_BEFORE_GUST = 0.1  # s
_LATEST_START = 20.0  # s


def first_gust(scene: Scene) -> float | None:
    """Return the simulated time, s, of the first gust that moves the sheet; None: never."""
    gust = scene.wind.gust
    blows = scene.has_air and gust.speed[1] > 0 and gust.duration > 0
    return gust.period if blows and gust.period > 0 else None


def start_time(scene: Scene) -> float:
    """Return the simulated time, s, at which a study starts: just before the first gust."""
    gust = first_gust(scene)
    if gust is None or gust >= _LATEST_START:
        return 0.0
    return max(gust - _BEFORE_GUST, 0.0)


@dataclass(frozen=True)
class Options:
    """
    Options of a study.

    Attributes
    ----------
    quick
        True for fewer settings and less time.
    seconds
        Simulated time, s; None: as long as the budget of time allows.
    goal, arrival
        Position that the sphere moves to, m, and the time that it takes, s; None: it stays.

    """

    quick: bool
    seconds: float | None = None
    goal: tuple[float, float, float] | None = None
    arrival: float = 1.0


class Schedule:
    """
    Settings and scenario of a study.

    Attributes
    ----------
    scene
        What is simulated, with its own integrator, tolerance and precision.
    settings, rates
        Settings that are compared on the grid and at the rate of the scene, and at other rates.
    levels
        Substeps per tick of the reference; the first ones are those of a run that estimates the
        smallest error, the others each twice the one before.
    scenario
        Start, duration and inputs of every run.
    begins
        Simulated time at its start, s: just before the first gust, if there are gusts.
    gust
        Time of the first gust since the start, s; None: none blows within the scenario.
    still
        True if the first gust comes too late to be part of it.
    wanted, full_cost
        Simulated time that was aimed at, s, and the expected wall-clock time, s, of the first
        runs of all settings over it; the scenario is shorter where they take too long.
    unit
        Wall-clock time of a substep, s, in the scene's own precision.

    """

    def __init__(self, scene: Scene, options: Options, cache: Cache) -> None:
        self.scene = scene.with_parameters({'solver.substeps': 0})
        self.quick = options.quick
        self.settings = plan(scene, quick=options.quick)
        self.rates = rates(self.scene, quick=options.quick)
        least = reference_setting(self.scene, 1).substeps
        most = max(
            self._substeps(setting) * setting.rate / scene.rate
            for setting in (*self.settings, *self.rates)
        )
        finest = math.ceil(most / least) * least
        doublings = range(_DOUBLINGS[options.quick] + 1)
        self.levels = (finest, *(_MARGIN * finest * 2**n for n in doublings))
        self._compile()
        self.begins = start_time(scene)
        start = state_at(self.scene.with_parameters({'solver.precision': 'double'}), self.begins)
        # A whole number of ticks at every rate that is compared.
        two_ticks = 2 / scene.rate
        samples = max(round((options.seconds or _SECONDS) / two_ticks), 1)
        self.scenario = Scenario(
            samples * two_ticks, two_ticks, start, options.goal, options.arrival
        )
        self._measure_unit()
        self.wanted, self.full_cost = self.scenario.seconds, self.expected
        if options.seconds is None:
            self._shorten(cache)
        gust = first_gust(scene)
        self.still = gust is not None and gust >= self.begins + self.scenario.seconds
        self.gust = None if gust is None or self.still else gust - self.begins

    def _compile(self) -> None:
        for method in INTEGRATORS:
            for precision in ('single', 'double'):
                changes = {'solver.method': method, 'solver.precision': precision}
                list(Cloth(self.scene.with_parameters(changes)).warm_up())

    def _measure_unit(self) -> None:
        """Measure the cost of a substep with contact, and the extra cost of double precision."""
        double = self.scene.with_parameters({'solver.precision': 'double'})
        self._ratio = Cloth(double).time_substep() / Cloth(self.scene).time_substep()
        run = simulate(Cloth(self.scene), self.scenario)
        self.unit = run.wall / run.substeps

    def _shorten(self, cache: Cache) -> None:
        """
        Shorten the scenario to the budget of time, but not below a tenth of it.

        Costs vary from run to run; the choice is cached, so that an interrupted study continues
        with the same scenario and finds its results.
        """
        scenario = self.scenario
        key = {
            'part': 'course',
            'scene': self.scene.flat(),
            'machine': describe(),
            'course': scenario.key,
            'quick': self.quick,
        }
        found = cache.load(key)
        if found is None:
            share = min(1.0, max(_BUDGET[self.quick] / max(self.expected, 1e-9), 0.1))
            samples = max(int(share * scenario.samples), min(6, scenario.samples))
            cache.save(key, [samples, self.full_cost])
        else:
            samples, self.full_cost = found[0]
        self.scenario = replace(scenario, seconds=samples * scenario.period)

    @property
    def expected(self) -> float:
        """Expected wall-clock time, s, of the first runs of all settings and references."""
        references = [self.reference(level) for level in self.levels]
        return sum(self.cost(setting) for setting in (*self.settings, *references, *self.rates))

    def reference(self, substeps: int) -> Setting:
        """Return the setting of the reference with `substeps` per tick."""
        return replace(reference_setting(self.scene, 1), substeps=substeps)

    def cost(self, setting: Setting) -> float:
        """Return the expected wall-clock time, s, of a run."""
        unit = self.unit * (self._ratio if setting.precision == 'double' else 1.0)
        return self._substeps(setting) * setting.rate * self.scenario.seconds * unit

    def runs(self, expected: float) -> int:
        """Return the number of runs of a setting whose run is expected to take so many s."""
        return _REPEATS[self.quick] if expected < _REPEATED[self.quick] else 2

    def _substeps(self, setting: Setting) -> int:
        """Return the number of substeps per tick, in slow motion."""
        length = substep_length(self.scene.with_parameters(setting.parameters))
        return round(1 / (setting.rate * length))
