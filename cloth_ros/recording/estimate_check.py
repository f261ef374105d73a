"""Compare the error estimates that a node published with the error that a finer run finds."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from ..scene import Scene
from .comparison import gap_text
from .recorded_cloth import LiveEstimate, RecordedCloth
from .repeated_cloth import OtherCloth, RepeatedCloth
from .resimulation import Settings
from .timeline import Entry, Gap, Start, Step, timeline

# Ticks in which the window of an estimate is looked for; it is evaluated some seconds later.
_RECENT = 20_000
# Estimates that wait for their ticks, and ticks after which these are looked for.
_WAITING, _EVERY = 100, 30
# Of the tolerance that is given up, in a finer run that was not described.
_FINER = 0.01


class Window(NamedTuple):
    """
    Window of an estimate.

    Attributes
    ----------
    first, last
        Numbers of the ticks after which it begins and ends.
    estimate
        The estimate.

    """

    first: int
    last: int
    estimate: LiveEstimate


class CheckedEstimate(NamedTuple):
    """An estimate, and the largest error of any particle that was found in its window, m."""

    estimate: LiveEstimate
    found: float


def find_windows(recorded: RecordedCloth) -> list[Window]:
    """Return the windows of the estimates in a recording, without those whose ticks are lost."""
    ticks: deque[tuple[int, float, float]] = deque(maxlen=_RECENT)
    waiting: deque[LiveEstimate] = deque(maxlen=_WAITING)
    windows: list[Window] = []
    known: LiveEstimate | None = None

    def find() -> None:
        while waiting and (window := _window(ticks, waiting[0])):
            windows.append(window)
            waiting.popleft()

    for entry in timeline(recorded):
        if isinstance(entry, Step):
            ticks.append((entry.record.tick, entry.record.time, entry.record.seconds))
            if waiting and entry.record.tick % _EVERY == 0:
                find()
        elif isinstance(entry, (Gap, Start)):
            find()
            ticks.clear()
            waiting.clear()
        elif isinstance(entry, LiveEstimate) and not _same(entry, known):
            known = entry
            waiting.append(entry)  # its ticks may be held for states that are to come
    find()
    return windows


def _window(ticks: deque[tuple[int, float, float]], estimate: LiveEstimate) -> Window | None:
    last = _tick_at(ticks, estimate.time)
    first = None if last is None else _tick_at(ticks, estimate.time - estimate.seconds, last)
    return None if last is None or first is None else Window(first, last, estimate)


def _same(first: LiveEstimate, second: LiveEstimate | None) -> bool:
    return second is not None and (first.largest, first.seconds) == (
        second.largest,
        second.seconds,
    )


def _tick_at(
    ticks: deque[tuple[int, float, float]], time: float, before: int | None = None
) -> int | None:
    """Return the last tick after which the simulated time was that, s; it is rounded."""
    for number, ended, seconds in reversed(ticks):
        if (before is None or number < before) and abs(ended - time) <= 0.5 * seconds:
            return number
    return None


def finer(scene: Scene) -> dict[str, object]:
    """Return parameters with which the error of a scene is a small part of what it was."""
    return {
        'solver.precision': 'double',
        'solver.substeps': 0,
        'solver.tolerance': max(_FINER * scene.solver.tolerance, 1e-7),
    }


class EstimateCheck:
    """
    A finer run in the window of each estimate, from the recorded state on.

    Parameters
    ----------
    windows
        In their order.
    settings
        Of the finer run; without parameters, those of `finer`.

    Attributes
    ----------
    checked
        The estimates, and what was found.
    gaps
        Ticks that were lost by the recorder, in words.

    """

    def __init__(self, windows: list[Window], settings: Settings) -> None:
        self._windows = deque(windows)
        self._exact = RepeatedCloth()

        def scene(recorded: Scene) -> Scene:
            changed = settings if settings.parameters else Settings(finer(recorded))
            return changed.scene(recorded)

        self._other = OtherCloth(scene)
        self._running = False
        self.checked: list[CheckedEstimate] = []
        self.gaps: list[str] = []

    def take(self, entry: Entry) -> None:
        """Simulate an entry of the timeline; raises ValueError for a damaged one."""
        if isinstance(entry, Start):
            self._exact.start(entry.keyframe)
            self._running = False
        elif isinstance(entry, Step):
            self._exact.repeat(entry.record)
            if self._running:
                self._other.repeat(entry.record)
            self._end_and_begin(entry.record.tick, entry.record.stamp)
        elif isinstance(entry, Gap):
            self.gaps.append(gap_text(entry))

    def _end_and_begin(self, tick: int, stamp: int) -> None:
        while self._windows and self._windows[0].last < tick:
            self._windows.popleft()
            self._running = False
        if self._running and self._windows[0].last == tick:
            positions = self._exact.cloth.positions
            others = self._other.positions_on(*positions.shape[:2])
            distance = np.linalg.norm(others - positions, axis=-1)
            window = self._windows.popleft()
            self.checked.append(CheckedEstimate(window.estimate, float(distance.max())))
            self._running = False
        if self._windows and self._windows[0].first == tick:
            self._other.start(self._exact.keyframe(tick, stamp))
            self._running = True

    @property
    def ratio(self) -> float | None:
        """Median of the estimates by the errors that were found; None without estimates."""
        ratios = [each.estimate.largest / each.found for each in self.checked if each.found > 0]
        return float(np.median(ratios)) if ratios else None

    def lines(self) -> list[str]:
        """Return the result in words."""
        if not self.checked:
            return ['no error estimate in the bag has a window that can be repeated']
        lines = ['simulated time [s]   window [s]   live estimate [mm]   error found [mm]']
        step = max(len(self.checked) // 10, 1)
        lines += [
            f'{each.estimate.time:18.2f}   {each.estimate.seconds:10.3f}   '
            f'{1e3 * each.estimate.largest:18.4g}   {1e3 * each.found:16.4g}'
            for each in self.checked[::step]
        ]
        if self.ratio is not None:
            lines.append(
                f'{len(self.checked)} live estimates are {self.ratio:.2g} times the error found '
                '(median)'
            )
        return lines + self.gaps
