"""Pacing: number of substeps to simulate in a tick, from the time passed and their cost."""

from __future__ import annotations

import math
from typing import NamedTuple

# Share of a tick that may be spent in the simulation; the rest is for messages and requests.
_SHARE = 0.8
# Weight of the newest tick in the running mean of the cost of a substep.
_NEWEST = 0.1
# Factor above the mean cost that is not exceeded until a second tick in a row confirms it.
_UNLIKELY = 10
# Length of time, in ticks, that one tick may always simulate: itself, with its usual lateness.
_LATE_TICK = 1.5
# Share of the longest time of a tick that counts as none: clocks and their sums are rounded.
_ROUNDING = 1e-6
# Share of the time passed that must be lost to be called slow motion: the real-time factor is
# reported to as many digits.
_NOTICEABLE = 1e-3


class PacingReport(NamedTuple):
    """
    What `Pacing` has measured since the last report.

    Attributes
    ----------
    real_time_factor
        Simulated time by time passed.
    lost
        Time given up, s; 0 if it is too little to notice.
    wall, cpu
        Wall-clock time that the simulation took, and processor time that it got, s.
    substeps
        Number of substeps, before fast motion divides them.

    """

    real_time_factor: float
    lost: float
    wall: float
    cpu: float
    substeps: int

    @property
    def cost(self) -> float:
        """Processor time of a substep, s; 0 if none was simulated."""
        return self.cpu / self.substeps if self.substeps else 0.0


class Pacing:
    """
    Relate simulated time to wall-clock time.

    Time is simulated in whole substeps of one length, whatever the jitter of the ticks: a substep
    length that varies all the time would add energy to a nearly undamped cloth.  A remainder
    below a substep is left to the next tick, or up to half a substep is simulated ahead.  When
    the machine is too slow, ticks keep their rate and time is given up: slow motion.

    Attributes
    ----------
    pending
        Wall-clock time that is not simulated yet, s; at least minus half a substep.
    lost
        Wall-clock time given up since the last `take_report`, s.

    """

    def __init__(self) -> None:
        self.pending = 0.0
        self.lost = 0.0
        self._cost: float | None = None
        self._last = 0.0
        self._elapsed = 0.0
        self._simulated = 0.0
        self._factor = 0.0
        self._substep = 0.0
        self._count = 0
        self._wall = self._cpu = 0.0

    def due(
        self,
        elapsed: float,
        substep: float,
        tick: float,
        max_tick: float,
        wall: float,
    ) -> int:
        """
        Return how many substeps to simulate now.

        Parameters
        ----------
        elapsed
            Time since the last call, s; negative if a clock has jumped back.
        substep, tick
            Length of a substep and of a tick, s; a tick holds at least one substep.
        max_tick
            Longest time to make up in one tick, s; at least 1.5 ticks are made up anyway.
        wall
            Wall-clock time of a tick, s.

        """
        self._substep = substep
        self._elapsed += max(elapsed, 0.0)
        self.pending += max(elapsed, 0.0)
        # At least a tick must be allowed, or the cloth would be slow on any machine.
        longest = max(max_tick, _LATE_TICK * tick)
        excess = self.pending - longest
        # Less than a substep is the remainder of the tick before, or rounding.
        if excess > max(substep, _ROUNDING * longest):
            self.lost += excess
            self.pending -= excess
        # Rounded, not cut off: with one substep a tick, jitter must not leave ticks without one.
        count = math.floor(self.pending / substep + 0.5)
        affordable = _SHARE * wall / self._cost if self._cost else math.inf
        if count > affordable:
            count = max(int(affordable), 1)
        return count

    def done(self, count: int, substep: float, wall: float, cpu: float = math.inf) -> None:
        """
        Record that substeps were simulated.

        Parameters
        ----------
        count, substep
            Their number, and the length of each, s.
        wall, cpu
            Wall-clock time that they took, and processor time that they got, s; at most the
            wall-clock time counts.

        """
        self.pending -= count * substep
        self._simulated += count * substep
        self._count += count
        self._wall += wall
        self._cpu += min(cpu, wall)  # both clocks have a resolution
        before, self._last = self._last, wall / count
        if self._cost is None:
            self._cost = self._last
            return
        # A process that was stopped in the middle of a tick has not become slow.
        likely = min(self._last, max(_UNLIKELY * self._cost, before))
        self._cost += _NEWEST * (likely - self._cost)

    def expect(self, cost: float) -> None:
        """Assume `cost`, s, for a substep until it is measured."""
        self._cost = cost

    def load(self, substep: float) -> float:
        """Return the share of real time that substeps of this length take; 0 if unknown."""
        return self.cost / substep

    @property
    def cost(self) -> float:
        """Wall-clock time of a substep, s; 0 if unknown."""
        return self._cost or 0.0

    def take_report(self) -> PacingReport:
        """
        Return what was measured since the last report.

        If less than a substep has passed, as between two slow ticks, the former real-time factor
        is returned: a substep simulated ahead must not count as speed.
        """
        passed = self._elapsed
        if passed > 0 and passed >= self._substep * (1 - _ROUNDING):
            self._factor = self._simulated / passed
            self._elapsed = self._simulated = 0.0
        lost = self.lost if self.lost > _NOTICEABLE * passed else 0.0
        report = PacingReport(self._factor, lost, self._wall, self._cpu, self._count)
        self.lost, self._wall, self._cpu, self._count = 0.0, 0.0, 0.0, 0
        return report

    def discard(self) -> None:
        """Discard time that is not simulated yet: the cloth is paused, held or was reset."""
        self.pending = 0.0
