"""The way of the sphere through one advance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .lattice import Array


class Path:
    """
    A polyline, run through at constant speed.

    Attributes
    ----------
    end
        Last point, m, shape (3,).

    """

    def __init__(self, points: Sequence[Array], start: float, seconds: float) -> None:
        corners = np.array(points)
        self.end: Array = corners[-1]
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        distance = np.concatenate([[0.0], np.cumsum(lengths)])
        self._straight: Array | None = None
        if len(points) <= 2:
            self._straight = (corners[-1] - corners[0]) / seconds
        elif distance[-1] > 0:
            self._corners = corners
            self._times = start + seconds * distance / distance[-1]
        else:
            self._straight = np.zeros(3)

    def _point(self, time: float) -> Array:
        return np.array([np.interp(time, self._times, axis) for axis in self._corners.T])

    def velocity(self, time: float, h: float) -> Array:
        """Return the mean velocity, m/s, shape (3,), over the `h` s from `time` on."""
        if self._straight is not None:
            return self._straight
        return (self._point(time + h) - self._point(time)) / h
