"""The way of the sphere, as commanded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...scene.parameter import checked_vector, invalid_value_error
from ..grid import Array

# Distance of the sphere's surface from the sheet, m, that can be commanded, and the number of
# positions that it passes in one advance.
_FARTHEST = 1000.0
_WAYPOINTS = 64
# m/s; what is faster is not swept, but appears where it is told to.
_FASTEST = 1e6


class Path:
    """
    A polyline, run through at constant speed.

    Attributes
    ----------
    end
        Last point, m, shape (3,).
    speed
        m/s.

    """

    def __init__(self, points: Sequence[Array], start: float, seconds: float) -> None:
        corners = np.array(points)
        self.end: Array = corners[-1]
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        distance = np.concatenate([[0.0], np.cumsum(lengths)])
        self.speed = float(distance[-1] / seconds)
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


class CommandedMotion:
    """
    Where the sphere is, and where it is told to go.

    Attributes
    ----------
    centre
        m, shape (3,), at the end of the last advance.
    waypoints
        What it is to pass in the next, m, each of shape (3,).

    """

    def __init__(self, centre: Sequence[float]) -> None:
        self.centre = np.array(centre, float)
        self.waypoints: list[Array] = []
        self._path = Path([self.centre], 0.0, 1.0)

    def command(self, position: Sequence[float], radius: float, sheet: Array) -> None:
        """
        Add a waypoint.

        Parameters
        ----------
        position, sheet
            Of the sphere, and centre of the sheet, m.
        radius
            Of the sphere, m.

        Raises
        ------
        ValueError
            The position is not finite or too far away.

        """
        centre = checked_vector('sphere position', position, 'sphere.position')
        if float(np.linalg.norm(centre - sheet)) > _FARTHEST + radius:
            raise invalid_value_error(
                'sphere position',
                centre.tolist(),
                f'within {_FARTHEST:g} m of the sheet',
                'bring it nearer',
            )
        self.waypoints = [*self.waypoints[1 - _WAYPOINTS :], centre]

    def jump(self, seconds: float) -> bool:
        """Go to the last waypoint at once if `seconds` are too few to sweep there; tell if so."""
        if not self.waypoints:
            return False
        way = np.linalg.norm(np.diff([self.centre, *self.waypoints], axis=0), axis=1).sum()
        if way <= _FASTEST * seconds:
            return False
        self.centre, self.waypoints = self.waypoints[-1], []
        return True

    @property
    def speed(self) -> float:
        """Of the sphere in this advance, m/s."""
        return self._path.speed

    def begin(self, start: float, seconds: float) -> None:
        """Set out on an advance of `seconds` from the time `start`, s, past the waypoints."""
        self._path = Path([self.centre, *self.waypoints], start, seconds)
        self.waypoints = []

    def velocity(self, time: float, h: float) -> Array:
        """Return the mean velocity, m/s, shape (3,), over the `h` s from `time` on."""
        return self._path.velocity(time, h)

    def end(self) -> None:
        """Arrive."""
        self.centre = self._path.end
