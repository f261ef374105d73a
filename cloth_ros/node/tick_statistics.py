"""How regular the ticks are, and how long messages take."""

from __future__ import annotations

from collections import deque

import numpy as np

_MOST = 4000  # ticks, the newest: some seconds at the highest rate


class TickStatistics:
    """Times of the ticks since the last report, s."""

    def __init__(self) -> None:
        self._intervals: deque[float] = deque(maxlen=_MOST)
        self._messages: deque[float] = deque(maxlen=_MOST)

    def __len__(self) -> int:
        """Return how many ticks will be reported."""
        return len(self._intervals)

    def add(self, interval: float, messages: float) -> None:
        """Note the time since the tick before, and what building and publishing messages took."""
        self._intervals.append(interval)
        self._messages.append(messages)

    def take_report(self, period: float) -> dict[str, object]:
        """Return the 99th percentile of what the intervals miss the period by, and of messages."""
        intervals, messages = list(self._intervals), list(self._messages)
        self._intervals.clear()
        self._messages.clear()
        if not intervals:
            return {}
        missed = np.abs(np.array(intervals) - period)
        return {
            'tick jitter, 99th percentile [s]': float(np.percentile(missed, 99)),
            'messages, 99th percentile [s]': float(np.percentile(messages, 99)),
        }
