"""Which ticks publish a topic whose rate is below that of the ticks."""

from __future__ import annotations


class RateLimit:
    """Say at each tick whether a message is due; the clock may jump back."""

    def __init__(self) -> None:
        self._last = self._next = 0.0

    def advance_to(self, now: float) -> None:
        """Have a message due at `now`, s, at the latest."""
        self._next = min(self._next, now)

    def due(self, now: float, rate: float, tick_rate: float) -> bool:
        """
        Return whether a message is due in the tick at `now`, and plan the next one.

        Parameters
        ----------
        now
            Time of the tick, s.
        rate, tick_rate
            Of the messages and of the ticks, Hz; above 0.

        """
        if now < self._last:
            self._next = 0.0
        self._last = now
        # Half a tick of tolerance: a tick that is early by its jitter is the one that was meant.
        if now < self._next - 0.5 / tick_rate:
            return False
        self._next = max(self._next + 1 / rate, now)
        return True
