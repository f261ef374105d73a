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
# Published times have six digits: their rounding, as a share of the time, and the most of it that
# still tells which tick is meant, as a share of that.
_ROUNDED, _NEAR = 5e-6, 0.25
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


class _Tick(NamedTuple):
    """A tick that was repeated: its number, simulated time at its end and length, s."""

    number: int
    time: float
    seconds: float
    changed: bool  # before it moved: no window goes on from the ticks before


def find_windows(recorded: RecordedCloth) -> list[Window]:
    """Return the windows of the estimates in a recording, without those whose ticks are lost."""
    ticks: deque[_Tick] = deque(maxlen=_RECENT)
    waiting: deque[LiveEstimate] = deque()  # for the last tick before they were published
    windows: list[Window] = []
    known: LiveEstimate | None = None

    def find(until: int) -> None:
        while waiting and waiting[0].tick <= until:
            window = _window(ticks, waiting.popleft())
            if window is not None:
                windows.append(window)

    for entry in timeline(recorded):
        if isinstance(entry, Step):
            record = entry.record
            find(record.tick - 1)
            ticks.append(_Tick(record.tick, record.time, record.seconds, bool(record.changes)))
        elif isinstance(entry, (Gap, Start)):
            find(ticks[-1].number if ticks else 0)
            ticks.clear()
            waiting.clear()  # those of lost ticks, whose numbers may come again
        elif isinstance(entry, LiveEstimate) and not _same(entry, known):
            known = entry
            waiting.append(entry)
    find(ticks[-1].number if ticks else 0)
    return windows


def _same(first: LiveEstimate, second: LiveEstimate | None) -> bool:
    return second is not None and (first.largest, first.seconds) == (
        second.largest,
        second.seconds,
    )


def _window(ticks: deque[_Tick], estimate: LiveEstimate) -> Window | None:
    """
    Return the window of an estimate; None if its ticks are not known.

    It ends with the last tick before the estimate at the end of which the simulated time was
    right, but for rounding: after a reset, times come again.  After a quarter of an hour, times
    are rounded too much.
    """
    last, seconds = None, 0.0
    for each in reversed(ticks):
        if last is None:
            if (
                each.number > estimate.tick
                or abs(each.time - estimate.time) > _NEAR * each.seconds
            ):
                continue
            if _ROUNDED * estimate.time > _NEAR * each.seconds:
                return None
            last = each.number
        seconds += each.seconds
        if each.seconds > 0 and abs(seconds - estimate.seconds) <= _NEAR * each.seconds:
            return Window(each.number - 1, last, estimate)
        if each.changed or seconds > estimate.seconds:
            return None
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
