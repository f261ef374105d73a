"""Statistics of the ticks: jitter, time for messages, jumps of the clock."""

from __future__ import annotations

from collections import deque

import numpy as np

from .tick_clock import Tick

_MOST = 4000  # ticks, the newest: some seconds at the highest rate


class TickStatistics:
    """
    Record the ticks since the last report.

    Attributes
    ----------
    ticks, jumps
        Number of ticks, and of those at which /clock has jumped, since the last report.
    jump
        Last jump, s.

    """

    def __init__(self) -> None:
        self.ticks = self.jumps = 0
        self.jump = 0.0
        self._intervals: deque[float] = deque(maxlen=_MOST)
        self._messages: deque[float] = deque(maxlen=_MOST)

    def __len__(self) -> int:
        """Return how many ticks will be reported."""
        return len(self._intervals)

    def begin(self, tick: Tick) -> None:
        """Record that a tick begins."""
        self.ticks += 1
        if tick.jump is not None:
            self.jumps, self.jump = self.jumps + 1, tick.jump

    def end(self, tick: Tick, messages: float) -> None:
        """Record the time, s, that building messages has taken in a tick."""
        if tick.jump is None:
            self._intervals.append(tick.elapsed)
            self._messages.append(messages)

    def take_report(self, period: float) -> dict[str, object]:
        """
        Return percentiles by name and unit, and reset.

        Parameters
        ----------
        period
            Usual time between two ticks, s; jitter is the deviation from it.

        """
        intervals, messages = list(self._intervals), list(self._messages)
        self._intervals.clear()
        self._messages.clear()
        self.ticks = self.jumps = 0
        if not intervals:
            return {}
        jitter = np.abs(np.array(intervals) - period)
        return {
            'tick jitter, 99th percentile [s]': float(np.percentile(jitter, 99)),
            'messages, 99th percentile [s]': float(np.percentile(messages, 99)),
        }
