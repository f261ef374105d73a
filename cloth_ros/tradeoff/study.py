"""Study of one scene: all measurements, in the order of their dependence."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from ..model import Cloth
from ..model.grid import Array
from ..model.integrators import INTEGRATORS
from ..model.resample import interpolate, resample_scene
from ..model.stability import SAFETY
from ..scene import Scene
from . import live_error, measured_stability
from .cache import NO_ARRAY, Cache
from .energy_budget import WorkAccount
from .machine import describe
from .reference_solution import (
    Horizon,
    blow_up_energy,
    distances,
    horizon,
    judge,
    reference_setting,
    time_together,
)
from .run import Run, Scenario, simulate, state_at
from .schedule import Schedule
from .settings import Setting, changed_pins, least_substeps, make_cloth

_GRIDS = {True: (0.25, 0.5, 1.0, 2.0), False: (0.25, 0.5, 1.0, 2.0, 4.0)}
# Expected cost of a run, s, above which a finer grid is left out.
_GRID_BUDGET = {True: 10.0, False: 60.0}
# Simulated time, s, of the run with live error estimates, at least: enough for windows of a
# second.
_ESTIMATED = {True: 0.0, False: 2.5}
# Distances between the two finest levels of the reference, m, whose times are reported.
_LENGTHS = (1e-4, 1e-3, 1e-2)
# Wall-clock time, s, of measuring a stability limit on 24 × 24 particles, and of booking the
# energy of a substep.
_STABILITY = 1.0
_ACCOUNT = 4e-4

Progress = Callable[[str, float], None]
Entry = dict[str, Any]


class Study:
    """
    Study of one scene.

    Parameters
    ----------
    name
        Of the scene, for the reports.
    scene
        As the user gave it.
    schedule
        Settings and scenario.
    cache
        Results of earlier studies.
    progress
        Called before each part with its description and its expected wall-clock time, s, and
        after it with an empty text and the same time.

    """

    def __init__(
        self, name: str, scene: Scene, schedule: Schedule, cache: Cache, progress: Progress
    ) -> None:
        self._name, self._given, self._schedule = name, scene, schedule
        self._scene, self._scenario, self._quick = (
            schedule.scene,
            schedule.scenario,
            schedule.quick,
        )
        self._cache, self._progress = cache, progress
        self._particles = scene.sheet.rows * scene.sheet.columns
        self._machine = describe()
        self._grids = self._plan_grids()
        self._state_at = lru_cache(maxsize=1)(state_at)  # the same for all repeats on a grid
        self._states = list(measured_stability.states(self._scene))
        own = self._schedule.settings[0]
        self._own_cost = schedule.cost(replace(own, substeps=0))

    @property
    def expected(self) -> float:
        """Expected wall-clock time of the study, s."""
        schedule = self._schedule
        costs = [schedule.cost(setting) for setting in (*schedule.settings, *schedule.rates)]
        total = sum(schedule.runs(cost) * cost for cost in costs)
        total += sum(schedule.cost(schedule.reference(level)) for level in schedule.levels)
        total += sum(schedule.runs(cost) * cost for _, cost in self._grids)
        total += _STABILITY * len(self._states) * len(INTEGRATORS)
        return total + self._account_cost() + self._live_cost()

    def run(self) -> Entry:
        """Measure everything; return the results as what `json` can represent."""
        schedule = self._schedule
        reference, between = self._reference()
        entries = self._measure([*schedule.settings, *schedule.rates], reference)
        stable = [np.array(entry['largest']) for entry in entries if not entry['unstable']]
        limit = horizon(between, stable)
        judged = [judge(e, reference, limit, self._scenario.times, self._scene) for e in entries]
        count = len(schedule.settings)
        return {
            'scene': self._name,
            'parameters': self._given.flat(),
            'machine': self._machine,
            'quick': self._quick,
            'course': {
                'seconds': self._scenario.seconds,
                'period': self._scenario.period,
                'wanted': schedule.wanted,
                'limited': self._scenario.seconds < schedule.wanted,
                'expected': schedule.full_cost,
                'begins at': schedule.begins,
                'gust at': schedule.gust,
                'before the gusts': schedule.still,
                'sphere sent to': self._scenario.goal,
                'over': self._scenario.arrival,
            },
            'reference': {
                'method': reference_setting(self._scene, 1).method,
                'substeps': list(self._levels),
                'agreement': limit.agreement,
                'smallest error': limit.smallest_error,
                'horizon': limit.samples * self._scenario.period,
                'contact': reference.contact,
                'apart': self._apart(between),
            },
            'settings': judged[:count],
            'rates': judged[count:],
            'grids': self._compare_grids(limit),
            'breaking': self._stability(),
            'budget': self._budget(),
            'live error': self._live_error(),
        }

    def _part(
        self, text: str, expected: float, make: Callable[[], tuple[Any, Array]], **what: Any
    ) -> tuple[Any, Array]:
        """Return the result of a part and its array, from the cache if it is there."""
        key = {
            'scene': self._scene.flat(),
            'machine': self._machine,
            'course': self._scenario.key,
            **what,
        }
        found = self._cache.load(key)
        if found is None:
            if text:
                self._progress(text, expected)
            found = make()
            self._cache.save(key, *found)
        self._progress('', expected)
        return found

    def _reference(self) -> tuple[Run, Array]:
        """Return the reference, and the distance of its two finest levels at each sample."""
        probe, coarser, *finer = self._schedule.levels
        probed, before = self._reference_run(probe), self._reference_run(coarser)
        for level in finer:
            run = self._reference_run(level)
            self._levels = (coarser, level)
            between = distances(before.positions, run.positions)[0]
            smallest = distances(probed.positions, run.positions)[0]
            if horizon(between, [smallest]).samples == self._scenario.samples:
                break
            coarser, before = level, run
        return run, between

    def _reference_run(self, substeps: int) -> Run:
        setting = self._schedule.reference(substeps)

        def make() -> tuple[Entry, Array]:
            run = simulate(make_cloth(self._scene, setting), self._scenario)
            names = ('energy', 'motion', 'stretch', 'contact')
            return {name: getattr(run, name) for name in names}, run.positions

        record, positions = self._part(
            f'reference, {setting.substeps} substeps',
            self._schedule.cost(setting),
            make,
            part='reference',
            setting=setting.as_dict(),
        )
        return Run(positions, **record)

    def _apart(self, between: Array) -> list[dict[str, float]]:
        """Return the times at which the two finest levels of the reference exceed distances."""
        return [
            {
                'distance': distance,
                'time': float(self._scenario.times[np.argmax(between > distance)]),
            }
            for distance in _LENGTHS
            if (between > distance).any()
        ]

    def _measure(self, settings: list[Setting], reference: Run) -> list[Entry]:
        """
        Return the record of each setting, with the cost of all its runs.

        All settings are run once, then all a second time, and so on: other load on the machine
        for a while then affects one run of each setting, not all runs of one.
        """
        expected = [self._schedule.cost(setting) for setting in settings]
        runs = [self._schedule.runs(seconds) for seconds in expected]
        records: list[Entry] = [{} for _ in settings]
        walls: list[list[float]] = [[] for _ in settings]
        for n in range(max(runs)):
            for k, setting in enumerate(settings):
                if n >= runs[k] or records[k].get('unstable'):
                    self._progress('', expected[k] if n < runs[k] else 0.0)
                    continue
                first = f'{setting.label}, {setting.rate:g} Hz'
                again = '' if k else f'run {n + 1} of every setting, for the range of costs'
                record, _ = self._part(
                    again if n else first,
                    expected[k],
                    partial(self._run_setting, setting, reference),
                    part='setting',
                    setting=setting.as_dict(),
                    levels=list(self._levels),
                    number=n,
                )
                records[k] = records[k] or record
                walls[k].append(record['wall'])
        return [
            {
                **record,
                'label': setting.label,
                'setting': setting.as_dict(),
                'nominal cost': cost / self._scenario.seconds,
                'refused': 0 < setting.substeps < least_substeps(self._scene, setting.method),
                'wall': _spread(wall),
            }
            for setting, record, cost, wall in zip(settings, records, expected, walls, strict=True)
        ]

    def _run_setting(self, setting: Setting, reference: Run) -> tuple[Entry, Array]:
        """Run a setting once and compare it with the reference."""
        cloth = make_cloth(self._scene, setting)
        list(cloth.warm_up())
        run = simulate(cloth, self._scenario, blow_up_energy(reference, self._scene))
        largest, square = distances(run.positions, reference.positions)
        record = {
            'substeps per tick': run.substeps / (run.seconds * setting.rate),
            'unstable': len(run.motion) < self._scenario.samples,
            'wall': run.wall / run.seconds,
            'particle steps': run.substeps * self._particles / run.seconds,
            'largest': largest.tolist(),
            'square': square.tolist(),
            'energy': run.energy,
            'stretch': run.stretch,
        }
        return record, NO_ARRAY

    def _plan_grids(self) -> list[tuple[Scene, float]]:
        """Return the same cloth on coarser and finer grids, and the expected cost of a run, s."""
        grids = []
        cost = self._schedule.unit / self._particles
        for factor in _GRIDS[self._quick]:
            scene = resample_scene(self._scene, factor)
            if scene is None:
                continue
            substeps = least_substeps(scene, 'position_verlet') * scene.rate
            particles = scene.sheet.rows * scene.sheet.columns
            seconds = self._scenario.seconds + self._schedule.begins
            expected = substeps * seconds * cost * particles
            if factor <= 1 or expected < _GRID_BUDGET[self._quick]:
                grids.append((scene, expected))
        return grids

    def _compare_grids(self, limit: Horizon) -> list[Entry]:
        """Return the cost of each grid, and its distance from the finest one."""
        entries, paths = [], []
        for scene, expected in self._grids:
            sheet = scene.sheet
            parts = [
                self._part(
                    '' if number else f'grid of {sheet.rows} × {sheet.columns}',
                    expected,
                    partial(self._run_grid, scene, number),
                    part='grid',
                    grid=[sheet.rows, sheet.columns],
                    number=number,
                )
                for number in range(self._schedule.runs(expected))
            ]
            record, path = parts[0]
            entries.append({**record, 'wall': _spread([each['wall'] for each, _ in parts])})
            paths.append(path)
        n = max(limit.samples, 1)
        for entry, path in zip(entries, paths, strict=True):
            finest = interpolate(paths[-1], entry['rows'], entry['columns'])
            largest, square = distances(path, finest)
            entry['largest'] = float(largest[:n].max())
            entry['rms'] = float(np.sqrt(square[:n].mean()))
            entry['together'] = time_together(
                largest, self._scenario.times, self._scene.sheet.diagonal
            )
        return entries

    def _run_grid(self, scene: Scene, number: int) -> tuple[Entry, Array]:
        """Run the cloth on a grid; repeats serve the cost only and return no positions."""
        cloth = make_cloth(scene, replace(self._schedule.settings[0], substeps=0))
        list(cloth.warm_up())
        scenario = replace(self._scenario, start=self._state_at(scene, self._schedule.begins))
        run = simulate(cloth, scenario)
        sheet = scene.sheet
        record = {
            'rows': sheet.rows,
            'columns': sheet.columns,
            'bending': scene.springs.bending,
            'pins': changed_pins(self._scene, scene),
            'wall': run.wall / run.seconds,
            'particle steps': run.substeps * sheet.rows * sheet.columns / run.seconds,
        }
        return record, NO_ARRAY if number else run.positions

    def _stability(self) -> list[Entry]:
        def measure(method: str, state: str) -> tuple[Entry, Array]:
            return asdict(measured_stability.compare(self._scene, method, state)), NO_ARRAY

        rows = []
        for method, state in itertools.product(INTEGRATORS, self._states):
            row, _ = self._part(
                f'stability limit of {method}, {state}',
                _STABILITY,
                partial(measure, method, state),
                part='breaking',
                method=method,
                state=state,
            )
            rows.append({'method': method, 'taken': SAFETY * row['bound'], **row})
        return rows

    def _account_cost(self) -> float:
        return self._own_cost * (1 + _ACCOUNT / self._schedule.unit)

    def _budget(self) -> Entry:
        def measure() -> tuple[Entry, Array]:
            account = WorkAccount(self._scene)
            cloth = Cloth(self._scene, observer=account, energy_monitor=None)
            for number, tick in enumerate(self._scenario.ticks(cloth)):
                if number == 0:
                    account.open(cloth)
                cloth.advance(tick)
            return account.budget().as_dict(), NO_ARRAY

        record, _ = self._part('the energy budget', self._account_cost(), measure, part='budget')
        return dict(record)

    def _live_scenario(self) -> Scenario:
        return replace(
            self._scenario, seconds=max(self._scenario.seconds, _ESTIMATED[self._quick])
        )

    def _live_cost(self) -> float:
        cost = self._schedule.cost(reference_setting(self._scene, live_error.DIVISION + 3))
        return cost * self._live_scenario().seconds / self._scenario.seconds

    def _live_error(self) -> list[Entry]:
        def measure() -> tuple[list[Entry], Array]:
            found = live_error.compare(self._scene, self._live_scenario())
            return [asdict(each) for each in found], NO_ARRAY

        record, _ = self._part(
            'the live error estimate',
            self._live_cost(),
            measure,
            part='live error',
            seconds=self._live_scenario().seconds,
        )
        return list(record)


def _spread(walls: list[float]) -> Entry:
    return {
        'median': statistics.median(walls),
        'least': min(walls),
        'greatest': max(walls),
        'runs': len(walls),
    }
