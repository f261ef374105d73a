"""Periodic gusts of random speed."""

from __future__ import annotations

import numpy as np

from ...scene import Gust
from ..grid import Array


class Gusts:
    """
    The gusts of a scene as a function of time alone.

    Gust number n blows from n × period for the duration, n = 1, 2, …, at a speed drawn from the
    seed and n.  So the gusts do not depend on the step, and are repeated after a reset.
    """

    def __init__(self, gust: Gust) -> None:
        self._gust = gust
        self._direction = np.array(gust.direction)
        self._number = 0
        self._velocity = np.zeros(3)

    def velocity(self, time: float) -> Array:
        """Return the velocity that gusts add to the air at `time` s, m/s, shape (3,)."""
        # Slightly later: the rounded time of a change may be just before it.
        time *= 1 + 1e-12
        number = int(time // self._gust.period)
        if number < 1 or time - number * self._gust.period >= self._gust.duration:
            return np.zeros(3)
        if number != self._number:
            generator = np.random.default_rng([self._gust.seed, number])
            self._number = number
            self._velocity = self._direction * generator.uniform(*self._gust.speed)
        return self._velocity

    def next_change(self, time: float) -> float:
        """Return when a gust next begins or ends after `time`, s."""
        number = int(time // self._gust.period)
        edges = [
            edge
            for n in (number, number + 1)
            for edge in (n * self._gust.period + self._gust.duration, (n + 1) * self._gust.period)
        ]
        return min(edge for edge in edges if edge > time)
