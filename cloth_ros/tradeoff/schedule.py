"""What a study of a scene runs, for how long, and what that is expected to cost."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ..model import Cloth, Scene
from ..model.methods import METHODS
from .machine import describe
from .reference import reference_setting
from .settings import Setting, make_cloth, plan, rates
from .store import Store
from .trial import Course, simulate

# Simulated time, s, and wall-clock time, s, that a study of one scene aims at.
_SECONDS = {True: 1.0, False: 3.0}
_BUDGET = {True: 30.0, False: 420.0}
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
    unit
        Wall-clock time of a substep, s, in the scene's own precision.

    """

    def __init__(self, scene: Scene, options: Options, store: Store) -> None:
        self.scene = scene.with_parameters({'solver.substeps': 0})
        self.quick = options.quick
        self.settings = plan(scene, quick=options.quick)
        self.rates = rates(self.scene, quick=options.quick)
        least = reference_setting(self.scene, 1).substeps
        most = max(self._substeps(setting) for setting in self.settings)
        finest = math.ceil(most / least) * least
        doublings = range(_HALVINGS[options.quick] + 1)
        self.levels = (finest, *(_MARGIN * finest * 2**n for n in doublings))
        self._compile()
        gust = scene.wind.gust
        self.begins, start = 0.0, None
        if 0 < gust.period < _LATEST_START:
            self.begins = max(gust.period - _BEFORE_GUST, 0.0)
            start = Cloth(self.scene.with_parameters({'solver.precision': 'double'}))
            start.advance(self.begins)
        # Every rate that is tried has whole ticks in two of the scene's.
        period = 2 / scene.rate
        samples = max(round((options.seconds or _SECONDS[self.quick]) / period), 1)
        goal = options.goal if scene.sphere.radius > 0 else None
        self.course = Course(samples * period, period, start, goal, options.arrival)
        self._price()
        if options.seconds is None:
            self._shorten(store)

    def _compile(self) -> None:
        for method in METHODS:
            for precision in ('single', 'double'):
                changes = {'solver.method': method, 'solver.precision': precision}
                Cloth(self.scene.with_parameters(changes)).warm_up()

    def _price(self) -> None:
        """Measure what a substep costs, contact included, and double precision more."""
        double = self.scene.with_parameters({'solver.precision': 'double'})
        self._ratio = Cloth(double).compile() / Cloth(self.scene).compile()
        run = simulate(Cloth(self.scene), self.course)
        self.unit = run.wall / run.substeps

    def _shorten(self, store: Store) -> None:
        """
        Shorten the course to what the budget of time allows, to a tenth of it at most.

        Prices vary from time to time; what was chosen once stays, or nothing of a study that was
        interrupted could be used.
        """
        course = self.course
        key = {
            'part': 'course',
            'scene': self.scene.flat(),
            'machine': describe(),
            'course': course.key,
            'quick': self.quick,
        }
        record = store.load(key)
        if record is None:
            share = min(1.0, max(_BUDGET[self.quick] / max(self.expected, 1e-9), 0.1))
            record = {'samples': max(int(share * course.samples), min(6, course.samples))}
            store.save(key, record)
        self.course = replace(course, seconds=record['samples'] * course.period)

    @property
    def expected(self) -> float:
        """Wall-clock time, s, that all runs are expected to take."""
        references = [self.reference(level) for level in self.levels]
        return sum(self.cost(setting) for setting in (*self.settings, *references, *self.rates))

    def reference(self, substeps: int) -> Setting:
        """Return the setting of the reference with `substeps` a tick."""
        return replace(reference_setting(self.scene, 1), substeps=substeps)

    def cost(self, setting: Setting) -> float:
        """Return the wall-clock time, s, that a run is expected to take."""
        price = self.unit * (self._ratio if setting.precision == 'double' else 1.0)
        return self._substeps(setting) * setting.rate * self.course.seconds * price

    def _substeps(self, setting: Setting) -> int:
        """Return the number of substeps a tick, in calm motion."""
        length = make_cloth(self.scene, setting).substep
        return setting.substeps or round(1 / (setting.rate * length))
