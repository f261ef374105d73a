"""Stamps of the states that are published."""

from __future__ import annotations


class StateStamps:
    """
    The time at which the present state is valid, which never goes back while no clock does.

    Steps of a paused cloth may be faster than the clock.  The states after them then get stamps a
    nanosecond apart, until the clock has caught up.

    Attributes
    ----------
    stamp
        ns.

    """

    def __init__(self) -> None:
        self.stamp = 0
        self._stepped = 0  # ns, by which the stamp may be ahead of the clock

    def restart(self, now: int) -> None:
        """Follow another clock, whose time is `now`, ns."""
        self.stamp, self._stepped = now, 0

    def tick(self, now: int, pending: float, *, jumped: bool) -> None:
        """
        Stamp the state after a tick.

        Parameters
        ----------
        now
            Time of the tick, ns.
        pending
            Time by which the state is older, s.
        jumped
            True if the clock has jumped.

        """
        stamp = max(now - int(pending * 1e9), 0)
        # More than the steps: the clock was set back.
        if not jumped and 0 <= self.stamp - stamp <= self._stepped:
            stamp = self.stamp + 1
        else:
            self._stepped = 0
        self.stamp = stamp

    def step(self, period: float) -> None:
        """Stamp the state after a step of a period, s."""
        self._stepped += round(1e9 * period)
        self.stamp += round(1e9 * period)
