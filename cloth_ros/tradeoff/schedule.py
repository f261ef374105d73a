"""What a study of a scene runs, for how long, and what that is expected to cost."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ..model import Cloth
from ..model.integrators import INTEGRATORS
from ..scene import Scene
from .cache import Cache
from .machine import describe
from .reference import reference_setting
from .run import Scenario, simulate, start_of
from .settings import Setting, make_cloth, plan, rates

# Simulated time, s, and wall-clock time of all first runs, s, that a study of one scene aims at.
_SECONDS = 1.0
_BUDGET = {True: 30.0, False: 200.0}
# A run is repeated, for the median of its cost, this often where it takes less than so many
# seconds, and otherwise twice.
_REPEATS = {True: 3, False: 5}
_REPEATED = {True: 1.0, False: 4.0}
# Substeps of the reference's first level, in multiples of the finest setting's, and how often
# they are halved at most.
_MARGIN = 4
_HALVINGS = {True: 1, False: 2}
_BEFORE_GUST = 0.1  # s
_LATEST_START = 20.0  # s


@dataclass(frozen=True)
class Options:
    """
    How a study is made, besides the scene.

    Attributes
    ----------
    quick
        True for few settings and little time.
    seconds
        Simulated time, s; None: what is affordable.
    goal, arrival
        Where the sphere is sent, m, and in which time, s; None: nowhere.

    """

    quick: bool
    seconds: float | None = None
    goal: tuple[float, float, float] | None = None
    arrival: float = 1.0


class Schedule:
    """
    The settings and the course of a study.

    Attributes
    ----------
    scene
        What is simulated, with its own method, tolerance and precision.
    settings, rates
        What is compared: on the grid and at the rate of the scene, and at other rates.
    levels
        Substeps a tick of the reference, each twice the one before; the first is that of a probe
        for the smallest error.
    course
        What happens in every run.
    begins
        Simulated time at its beginning, s: just before the first gust, where there are gusts.
    still
        True if the first gust comes too late to be a part of it.
    unit
        Wall-clock time of a substep, s, in the scene's own precision.

    """

    def __init__(self, scene: Scene, options: Options, store: Cache) -> None:
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
        doublings = range(_HALVINGS[options.quick] + 1)
        self.levels = (finest, *(_MARGIN * finest * 2**n for n in doublings))
        self._compile()
        period = scene.wind.gust.period
        self.still = period >= _LATEST_START
        self.begins = 0.0 if self.still else max(period - _BEFORE_GUST, 0.0)
        start = start_of(self.scene.with_parameters({'solver.precision': 'double'}), self.begins)
        # Every rate that is tried has whole ticks in two of the scene's.
        two_ticks = 2 / scene.rate
        samples = max(round((options.seconds or _SECONDS) / two_ticks), 1)
        self.scenario = Scenario(
            samples * two_ticks, two_ticks, start, options.goal, options.arrival
        )
        self._price()
        if options.seconds is None:
            self._shorten(store)

    def _compile(self) -> None:
        for method in INTEGRATORS:
            for precision in ('single', 'double'):
                changes = {'solver.method': method, 'solver.precision': precision}
                Cloth(self.scene.with_parameters(changes)).compile()

    def _price(self) -> None:
        """Measure what a substep costs, contact included, and double precision more."""
        double = self.scene.with_parameters({'solver.precision': 'double'})
        self._ratio = Cloth(double).compile() / Cloth(self.scene).compile()
        run = simulate(Cloth(self.scene), self.scenario)
        self.unit = run.wall / run.substeps

    def _shorten(self, store: Cache) -> None:
        """
        Shorten the course to what the budget of time allows, to a tenth of it at most.

        Prices vary from time to time; what was chosen once stays, or nothing of a study that was
        interrupted could be used.
        """
        scenario = self.scenario
        key = {
            'part': 'course',
            'scene': self.scene.flat(),
            'machine': describe(),
            'course': scenario.key,
            'quick': self.quick,
        }
        found = store.load(key)
        if found is None:
            share = min(1.0, max(_BUDGET[self.quick] / max(self.expected, 1e-9), 0.1))
            samples = max(int(share * scenario.samples), min(6, scenario.samples))
            store.save(key, samples)
        else:
            samples = found[0]
        self.scenario = replace(scenario, seconds=samples * scenario.period)

    @property
    def expected(self) -> float:
        """Wall-clock time, s, that the first run of everything is expected to take."""
        references = [self.reference(level) for level in self.levels]
        return sum(self.cost(setting) for setting in (*self.settings, *references, *self.rates))

    def reference(self, substeps: int) -> Setting:
        """Return the setting of the reference with `substeps` a tick."""
        return replace(reference_setting(self.scene, 1), substeps=substeps)

    def cost(self, setting: Setting) -> float:
        """Return the wall-clock time, s, that a run is expected to take."""
        price = self.unit * (self._ratio if setting.precision == 'double' else 1.0)
        return self._substeps(setting) * setting.rate * self.scenario.seconds * price

    def runs(self, expected: float) -> int:
        """Return how often a run that takes so many seconds is made."""
        return _REPEATS[self.quick] if expected < _REPEATED[self.quick] else 2

    def _substeps(self, setting: Setting) -> int:
        """Return the number of substeps a tick, in calm motion."""
        length = make_cloth(self.scene, setting).substep
        return setting.substeps or round(1 / (setting.rate * length))
