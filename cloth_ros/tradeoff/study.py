"""The study of one scene: everything that is measured, in the order in which it is needed."""

from __future__ import annotations

import importlib
import statistics
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from ..model import Cloth, Scene
from ..model.lattice import Array
from ..model.methods import METHODS, method_of
from ..model.stability import SAFETY
from . import live_error
from .energy_budget import AccountedCloth
from .grids import on_grid, sampled
from .machine import describe
from .reference import (
    Horizon,
    distances,
    horizon,
    judge,
    reference_setting,
    time_together,
    wildest,
)
from .schedule import Schedule
from .settings import Setting, least_substeps, make_cloth
from .store import Store
from .trial import Course, Run, simulate

_REPEATS = {True: 3, False: 5}
# A run is repeated, for the median of its cost, where that takes less than this, s.
_REPEATED = {True: 0.5, False: 4.0}
_GRIDS = {True: (0.25, 0.5, 1.0, 2.0), False: (0.25, 0.5, 1.0, 2.0, 4.0)}
# A finer grid is left out where its run would take longer than this, s.
_GRID_PATIENCE = {True: 10.0, False: 120.0}
# Distances of two runs, m, whose times are reported.
_LENGTHS = (1e-4, 1e-3, 1e-2)

Progress = Callable[[str, float], None]


class Study:
    """
    Measures one scene.

    Parameters
    ----------
    name
        Of the scene, for the reports.
    scene
        As it was given.
    schedule
        What is run.
    store
        What was measured before.
    progress
        Called with what comes next and the seconds that it is expected to take, after each part
        with an empty text and the seconds that it was expected to take.

    """

    def __init__(
        self, name: str, scene: Scene, schedule: Schedule, store: Store, progress: Progress
    ) -> None:
        self._name, self._given, self._schedule = name, scene, schedule
        self._scene, self._course, self._quick = schedule.scene, schedule.course, schedule.quick
        self._store, self._progress = store, progress
        self._particles = scene.sheet.rows * scene.sheet.columns
        self._machine = describe()

    def run(self) -> dict[str, Any]:
        """Measure everything, and return it as what `json` can write."""
        reference, between = self._reference()
        settings = [self._measure(setting, reference) for setting in self._schedule.settings]
        stable = [np.array(entry['largest']) for entry in settings if not entry['unstable']]
        limit = horizon(between, stable)
        return {
            'scene': self._name,
            'parameters': self._given.flat(),
            'machine': self._machine,
            'quick': self._quick,
            'course': {
                'seconds': self._course.seconds,
                'period': self._course.period,
                'begins at': self._schedule.begins,
                'sphere sent to': self._course.goal,
                'over': self._course.arrival,
            },
            'reference': {
                'method': reference_setting(self._scene, 1).method,
                'substeps': list(self._levels),
                'agreement': limit.agreement,
                'smallest error': limit.smallest_error,
                'horizon': limit.samples * self._course.period,
                'apart': self._apart(between),
            },
            'settings': [self._judge(entry, reference, limit) for entry in settings],
            'rates': [
                self._judge(
                    self._measure(setting, reference, f'{setting.rate:g} Hz'), reference, limit
                )
                for setting in self._schedule.rates
            ],
            'grids': self._grids(),
            'breaking': self._breaking(),
            'budget': self._budget(),
            'live error': self._live_error(),
        }

    def _key(self, part: str, **what: Any) -> dict[str, Any]:
        return {
            'part': part,
            'scene': self._scene.flat(),
            'machine': self._machine,
            'course': self._course.key,
            **what,
        }

    def _part(
        self, text: str, expected: float, make: Callable[[], Any], name: str, **what: Any
    ) -> Any:
        """Return the result of a part, measured now unless it was before."""
        key = self._key(name, **what)
        record = self._store.load(key)
        if record is None:
            self._progress(text, expected)
            record = {'result': make()}
            self._store.save(key, record)
        self._progress('', expected)
        return record['result']

    def _reference(self) -> tuple[Run, Array]:
        """Return the reference, and how far its two finest levels are apart at each sample."""
        probe, coarser, *finer = self._schedule.levels
        probed, before = self._reference_run(probe), self._reference_run(coarser)
        for level in finer:
            run = self._reference_run(level)
            self._levels = (coarser, level)
            between = distances(before.positions, run.positions)[0]
            smallest = distances(probed.positions, run.positions)[0]
            if horizon(between, [smallest]).samples == self._course.samples:
                break
            coarser, before = level, run
        return run, between

    def _reference_run(self, substeps: int) -> Run:
        setting = self._schedule.reference(substeps)
        expected = self._schedule.cost(setting)
        key = self._key('reference', setting=setting.as_dict())
        record, positions = self._store.load(key), self._store.load_array(key)
        if record is None or positions is None:
            self._progress(f'reference, {setting.substeps} substeps', expected)
            run = simulate(make_cloth(self._scene, setting), self._course)
            record = {'energy': run.energy, 'motion': run.motion, 'strain': run.strain}
            self._store.save_array(key, run.positions)
            self._store.save(key, record)
            positions = run.positions
        self._progress('', expected)
        return Run(positions, **record)

    def _apart(self, between: Array) -> list[dict[str, float]]:
        """Return when the two finest levels of the reference are first apart by some lengths."""
        return [
            {
                'distance': distance,
                'time': float(self._course.times[np.argmax(between > distance)]),
            }
            for distance in _LENGTHS
            if (between > distance).any()
        ]

    def _measure(self, setting: Setting, reference: Run, text: str = '') -> dict[str, Any]:
        return dict(
            self._part(
                text or setting.label,
                self._schedule.cost(setting),
                lambda: self._run_setting(setting, reference),
                'setting',
                setting=setting.as_dict(),
                levels=list(self._levels),
                quick=self._quick,
            )
        )

    def _run_setting(self, setting: Setting, reference: Run) -> dict[str, Any]:
        """Run a setting, several times where that is cheap, and compare it with the reference."""
        cloth = make_cloth(self._scene, setting)
        cloth.warm_up()
        limit = wildest(reference)
        runs = [simulate(cloth, self._course, limit)]
        unstable = len(runs[0].motion) < self._course.samples
        if not unstable and runs[0].wall < _REPEATED[self._quick]:
            runs += [simulate(cloth, self._course) for _ in range(_REPEATS[self._quick] - 1)]
        run = runs[0]
        largest, square = distances(run.positions, reference.positions)
        walls = sorted(each.wall / each.seconds for each in runs)
        return {
            'label': setting.label,
            'setting': setting.as_dict(),
            'substeps per tick': run.substeps / (run.seconds * setting.rate),
            'nominal cost': self._schedule.cost(setting) / self._course.seconds,
            'refused': 0 < setting.substeps < least_substeps(self._scene, setting.method),
            'unstable': unstable,
            'wall': {
                'median': statistics.median(walls),
                'least': walls[0],
                'greatest': walls[-1],
                'runs': len(walls),
            },
            'particle steps': run.substeps * self._particles / run.seconds,
            'largest': largest.tolist(),
            'square': square.tolist(),
            'energy': run.energy,
            'strain': run.strain,
        }

    def _judge(self, entry: dict[str, Any], reference: Run, limit: Horizon) -> dict[str, Any]:
        return judge(entry, reference, limit, self._course.times, self._scene.sheet.diagonal)

    def _grids(self) -> list[dict[str, Any]]:
        """Return cost and distance to the finest grid of the same cloth, for each grid."""
        cost = self._schedule.unit / self._particles
        entries, positions = [], []
        for factor in _GRIDS[self._quick]:
            scene = on_grid(self._scene, factor)
            if scene is None:
                continue
            sheet = scene.sheet
            cloth_seconds = self._course.seconds + self._schedule.begins
            substeps = least_substeps(scene, method_of('auto').name) * scene.rate
            expected = substeps * cloth_seconds * cost * sheet.rows * sheet.columns
            if factor > 1 and expected > _GRID_PATIENCE[self._quick]:
                break
            key = self._key('grid', factor=factor, default=self._scene.solver.flat())
            record, path = self._store.load(key), self._store.load_array(key)
            if record is None or path is None:
                self._progress(f'grid of {sheet.rows} × {sheet.columns}', expected)
                record, path = self._run_grid(scene)
                self._store.save_array(key, path)
                self._store.save(key, record)
            self._progress('', expected)
            entries.append(record)
            positions.append(path)
        times = self._course.times
        for entry, path in zip(entries, positions, strict=True):
            finest = sampled(positions[-1], entry['rows'], entry['columns'])
            largest, square = distances(path, finest)
            entry['largest'] = float(largest.max())
            entry['rms'] = float(np.sqrt(square.mean()))
            entry['together'] = time_together(largest, times, self._scene.sheet.diagonal)
        return entries

    def _run_grid(self, scene: Scene) -> tuple[dict[str, Any], Array]:
        cloth = Cloth(scene)
        cloth.warm_up()
        course = self._course
        if self._schedule.begins:
            cloth.advance(self._schedule.begins)
            start = Cloth(scene)
            start.adopt(cloth)
            course = Course(course.seconds, course.period, start, course.goal, course.arrival)
        run = simulate(cloth, course)
        sheet = scene.sheet
        record = {
            'rows': sheet.rows,
            'columns': sheet.columns,
            'bending': scene.springs.bending,
            'wall': run.wall / course.seconds,
            'particle steps': run.substeps * sheet.rows * sheet.columns / course.seconds,
        }
        return record, run.positions

    def _breaking(self) -> list[dict[str, Any]]:
        def measure() -> list[dict[str, Any]]:
            return [
                {'method': method, 'taken': SAFETY * row.bound, **asdict(row)}
                for method in METHODS
                for row in importlib.import_module('cloth_ros.tradeoff.breaking').compare(
                    self._scene, method
                )
            ]

        result: list[dict[str, Any]] = self._part(
            'where the methods break', 4.0, measure, 'breaking'
        )
        return result

    def _budget(self) -> dict[str, Any]:
        def measure() -> dict[str, Any]:
            cloth = AccountedCloth(self._scene)
            self._course.begin(cloth)
            cloth.open()
            origin, tick = cloth.sphere_position, 1 / self._scene.rate
            for number in range(round(self._course.seconds * self._scene.rate)):
                self._course.command(cloth, origin, (number + 1) * tick)
                cloth.advance(tick)
            budget = cloth.budget()
            return {
                **asdict(budget),
                'unexplained': budget.unexplained,
                'closure': budget.closure,
            }

        result: dict[str, Any] = self._part('the energy budget', 3.0, measure, 'budget')
        return result

    def _live_error(self) -> list[dict[str, Any]]:
        setting = reference_setting(self._scene, 16)
        result: list[dict[str, Any]] = self._part(
            'the live error estimate',
            self._schedule.cost(setting),
            lambda: [asdict(each) for each in live_error.compare(self._scene, self._course)],
            'live error',
        )
        return result
