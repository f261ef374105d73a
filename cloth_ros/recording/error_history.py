"""Error of a recorded run over time, against another run."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

# Entries of the history that is kept for the plot, whatever the length of the recording.
_ENTRIES = 4096
# Resets that are kept for it.
_RESETS = 100


class ErrorEntry(NamedTuple):
    """
    Error in some ticks that follow each other.

    Attributes
    ----------
    time
        Simulated since the beginning, s: a reset does not return to zero.
    largest, rms
        Largest distance of a particle, and the root of the mean square, m; of several ticks the
        largest of each.

    """

    time: float
    largest: float
    rms: float


class ErrorHistory:
    """
    Error over time: each tick in a file, and a history of bounded length for the plot.

    Parameters
    ----------
    path
        CSV file to write; None: no file.

    Attributes
    ----------
    entries
        The history.
    largest
        Largest error of any particle at any time, m.
    count
        Number of ticks.
    last
        The last tick.
    resets
        Times at which the cloth was reset, s since the beginning; the first ones.

    """

    def __init__(self, path: Path | None) -> None:
        self._file = None if path is None else path.open('w', newline='')
        if self._file is not None:
            self._rows = csv.writer(self._file)
            self._rows.writerow(
                ['stamp [ns]', 'simulated time [s]', 'largest error [m]', 'rms error [m]']
            )
        self.entries: list[ErrorEntry] = []
        self.largest, self.count = 0.0, 0
        self.last = ErrorEntry(0.0, 0.0, 0.0)
        self.resets: list[float] = []
        self._elapsed = 0.0
        self._sum = 0.0
        self._ticks_each = 1
        self._part: list[ErrorEntry] = []

    def advance(self, seconds: float, *, reset: bool) -> None:
        """Pass over a tick of some length, s, before which the cloth may have been reset."""
        if reset and len(self.resets) < _RESETS:
            self.resets.append(self._elapsed)
        self._elapsed += seconds

    def add(self, stamp: int, time: float, distance: NDArray[np.float64]) -> None:
        """Add the distances of all particles, m, at a simulated time, s, stamped in ns."""
        mean_square = float(np.mean(distance**2))
        largest, rms = float(distance.max()), math.sqrt(mean_square)
        entry = self.last = ErrorEntry(self._elapsed, largest, rms)
        if self._file is not None:
            self._rows.writerow([stamp, f'{time:.9g}', f'{entry.largest:.6g}', f'{entry.rms:.6g}'])
        self.largest = max(self.largest, entry.largest)
        self.count += 1
        self._sum += mean_square
        self._part.append(entry)
        if len(self._part) >= self._ticks_each:
            self.entries.append(_merged(self._part))
            self._part.clear()
        if len(self.entries) >= _ENTRIES:
            pairs = zip(self.entries[::2], self.entries[1::2], strict=False)
            self.entries = [_merged(list(pair)) for pair in pairs]
            self._ticks_each *= 2

    def close(self) -> None:
        """Close the file."""
        if self._part:
            self.entries.append(_merged(self._part))
        if self._file is not None:
            self._file.close()

    def summary(self) -> dict[str, Any]:
        """Return the numbers for the report."""
        return {
            'states': self.count,
            'largest error [m]': self.largest,
            'rms error [m]': math.sqrt(self._sum / self.count) if self.count else 0.0,
            'largest error at the end [m]': self.last.largest,
            'rms error at the end [m]': self.last.rms,
        }


def _merged(entries: list[ErrorEntry]) -> ErrorEntry:
    return ErrorEntry(
        entries[-1].time,
        max(entry.largest for entry in entries),
        max(entry.rms for entry in entries),
    )
