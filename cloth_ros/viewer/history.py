"""Measured values of the last minutes, for plots."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

_LONGEST = 600  # values that are kept


class History:
    """
    Values of one quantity by time.

    Parameters
    ----------
    seconds
        How long values are kept.

    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._values: deque[tuple[float, float]] = deque(maxlen=_LONGEST)

    def __len__(self) -> int:
        return len(self._values)

    def add(self, now: float, value: float) -> None:
        """Add a value at a time, s; what is not finite is left out."""
        if math.isfinite(value):
            self._values.append((now, value))

    def curve(self, now: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the times relative to `now`, s, not positive, and the values."""
        while self._values and self._values[0][0] < now - self._seconds:
            self._values.popleft()
        table = np.array(self._values, np.float64).reshape(-1, 2)
        return table[:, 0] - now, table[:, 1]
