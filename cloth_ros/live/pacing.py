"""How much to simulate in a tick: the wall clock, as far as the machine can follow it."""

from __future__ import annotations

import math

# Share of a tick that may go into the simulation; the rest is for messages and requests.
_SHARE = 0.8
# Weight of the newest tick in the running mean of the cost of a substep.
_NEWEST = 0.1
# How much dearer than the mean a tick is believed to be before the next one has said the same.
_SURPRISING = 10
# Ticks that one tick may always make up: itself, late by what is ordinary.
_ORDINARY = 1.5


class Pacing:
    """
    Book-keeping between wall-clock time and simulated time.

    Time is simulated in whole substeps of one length, whatever the jitter of the ticks: a step
    that changes all the time would pump energy into a nearly undamped cloth.  What is left of a
    substep waits for the next tick, or is simulated ahead by up to half a substep.  When the
    machine cannot keep up, ticks keep their rate and time is lost: slow motion.

    Attributes
    ----------
    pending
        Wall-clock time that is not simulated yet, s; down to minus half a substep.
    lost
        Wall-clock time that was given up since the last `take_report`, s.

    """

    def __init__(self) -> None:
        self.pending = 0.0
        self.lost = 0.0
        self._cost: float | None = None
        self._last = 0.0
        self._elapsed = 0.0
        self._simulated = 0.0
        self._factor = 0.0

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
            Wall-clock time since the last call, s; negative when a clock has jumped back.
        substep, tick
            Length of a substep and of a tick, s; a tick holds at least one substep.
        max_tick
            Longest time to make up, s; an ordinary tick is never longer.
        wall
            Wall-clock time of a tick, s.

        """
        self._elapsed += max(elapsed, 0.0)
        self.pending += max(elapsed, 0.0)
        # A tick must hold itself, or the cloth would be slow on any machine.
        excess = self.pending - max(max_tick, _ORDINARY * tick)
        if excess > 0:
            self.lost += excess
            self.pending -= excess
        # Rounded, not cut off: with one substep a tick, jitter must not leave ticks without one.
        count = math.floor(self.pending / substep + 0.5)
        affordable = _SHARE * wall / self._cost if self._cost else math.inf
        if count > affordable:
            count = max(int(affordable), 1)
        return count

    def done(self, count: int, substep: float, wall: float) -> None:
        """Note that `count` substeps were simulated, which took `wall` s."""
        self.pending -= count * substep
        self._simulated += count * substep
        before, self._last = self._last, wall / count
        if self._cost is None:
            self._cost = self._last
            return
        # Who was stopped in the middle of a tick has not become slow.
        likely = min(self._last, max(_SURPRISING * self._cost, before))
        self._cost += _NEWEST * (likely - self._cost)

    def expect(self, cost: float) -> None:
        """Take `cost`, s, for that of a substep until it is measured."""
        self._cost = cost

    def load(self, substep: float) -> float:
        """Return the share of real time that substeps of this length take; 0 if unknown."""
        return self.cost / substep

    @property
    def cost(self) -> float:
        """Wall-clock time of a substep, s; 0 if unknown."""
        return self._cost or 0.0

    def take_report(self) -> tuple[float, float]:
        """
        Return the real-time factor and the time lost, s, since the last report.

        Between two slow ticks there may be a report in which no time has passed: the factor is
        then what it was.
        """
        if self._elapsed > 0:
            self._factor = self._simulated / self._elapsed
        lost, self.lost, self._elapsed, self._simulated = self.lost, 0.0, 0.0, 0.0
        return self._factor, lost

    def forget(self) -> None:
        """Drop time that is not simulated yet: the cloth was paused or reset."""
        self.pending = 0.0
