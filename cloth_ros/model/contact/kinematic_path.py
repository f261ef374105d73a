"""Path of a collider in one advance: a polyline of waypoints, passed at constant speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...scene.parameter import checked_vector, invalid_value_error
from ...scene.yaml_text import write
from ..grid import Array
from ..inputs import Vector

# Greatest distance, m, of a collider's surface from the sheet that can be commanded.
_FARTHEST = 1000.0
# Waypoints of a collider that are kept for one advance.
MAX_WAYPOINTS = 64


class KinematicPath:
    """
    A polyline, passed at constant speed.

    Parameters
    ----------
    points
        m, each of shape (3,); the first is the start.
    start, seconds
        Time at the start, and duration, s.

    Attributes
    ----------
    end
        Last point, m, shape (3,).
    speed
        m/s.

    """

    def __init__(self, points: Sequence[Array], start: float, seconds: float) -> None:
        corners = np.array(points, float)
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


def extend_path(start: Vector, path: Sequence[Vector], target: Vector) -> tuple[Vector, ...]:
    """
    Return a path with one more waypoint at its end, thinned evenly to `MAX_WAYPOINTS`.

    Where there are too many, the waypoint is left out that leaves the shortest piece of path
    between its neighbours.  No piece becomes longer by that than 1/32 of the whole path.

    Parameters
    ----------
    start
        Where the path begins, m; not a waypoint itself.
    path
        Waypoints so far, m.
    target
        The new one, m; it is always kept.

    """
    extended = (*path, target)
    if len(extended) <= MAX_WAYPOINTS:
        return extended
    lengths = np.linalg.norm(np.diff((start, *extended), axis=0), axis=1)
    left_out = int(np.argmin(lengths[:-1] + lengths[1:]))
    return extended[:left_out] + extended[left_out + 1 :]


def checked_target(
    name: str, position: Sequence[float], parameter: str, size: float, sheet: Array
) -> Vector:
    """
    Return a commanded position of a collider, m.

    Parameters
    ----------
    name
        Of the collider, for the error.
    position
        Three numbers, m.
    parameter
        Scene parameter whose range applies.
    size
        Distance of the collider's surface from its centre, m.
    sheet
        Position of the sheet, m, shape (3,).

    Raises
    ------
    ValueError
        The position is not finite, out of range, or too far from the sheet.

    """
    centre = checked_vector(f'{name} position', position, parameter)
    distance, most = float(np.linalg.norm(centre - sheet)), _FARTHEST + size
    if distance > most:
        nearest = sheet + (centre - sheet) * (most * (1 - 1e-9) / distance)
        raise invalid_value_error(
            f'{name} position',
            centre.tolist(),
            f'within {_FARTHEST:g} m of the sheet',
            f'the nearest allowed value is {write(nearest.tolist())}',
        )
    x, y, z = centre.tolist()
    return (x, y, z)
