"""Commanded path of a body in one advance: poses, and what kernels take about the motion."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..scene.parameter import checked_vector, invalid_value_error
from ..scene.quaternion import checked_orientation, rotation_matrix
from ..scene.yaml_text import write
from .grid import Array
from .inputs import Pose, Vector

# Greatest distance, m, of a body's surface from the sheet that can be commanded.
_FARTHEST = 1000.0
# Waypoints of a body that are kept for one advance.
MAX_WAYPOINTS = 64


def _angle(first: Array, second: Array) -> float:
    """Return the angle, rad, between two orientations, 0 to π."""
    return 2 * math.acos(min(abs(float(first @ second)), 1.0))


def _turned(first: Array, second: Array, angles: Array, share: Array) -> Array:
    """
    Return orientations, shape (n, 4), by spherical linear interpolation.

    Parameters
    ----------
    first, second
        At both ends, shape (n, 4) or (4,).
    angles
        Between them, rad, shape (n,) or (1,).
    share
        Of the way, shape (n,).

    """
    half = 0.5 * angles
    small = half < 1e-6  # where it is linear
    sine = np.where(small, 1.0, np.sin(half))
    near = np.where(small, 1 - share, np.sin((1 - share) * half) / sine)
    far = np.where(small, share, np.sin(share * half) / sine)
    turned = near[:, None] * first + far[:, None] * second
    unit: Array = turned / np.sqrt(np.einsum('ij,ij->i', turned, turned))[:, None]
    return unit


class KinematicPath:
    """
    A polyline of poses, passed at constant speed; each turn takes as long as its piece of path.

    Parameters
    ----------
    poses
        x y z, m, and unit quaternion x y z w, each; the first is the start.
    start, seconds
        Time at the start, and duration, s.
    radius
        m; what a turn moves at this distance counts as length of the path.

    Attributes
    ----------
    end
        Last pose, shape (7,).
    length
        Of the path of the origin, m.
    turned
        Sum of all turns, rad.

    """

    def __init__(
        self, poses: Sequence[Sequence[float]], start: float, seconds: float, radius: float
    ) -> None:
        corners = np.array(poses, float)
        for n in range(1, len(corners)):  # q and −q are the same orientation: take the short way
            if corners[n, 3:] @ corners[n - 1, 3:] < 0:
                corners[n, 3:] *= -1
        self.end: Array = corners[-1].copy()
        lengths = np.linalg.norm(np.diff(corners[:, :3], axis=0), axis=1)
        pairs = zip(corners[:-1, 3:], corners[1:, 3:], strict=True)
        angles = np.array([_angle(first, second) for first, second in pairs])
        self.length, self.turned = float(lengths.sum()), float(angles.sum())
        weights = np.hypot(lengths, radius * angles)
        along = np.concatenate([[0.0], np.cumsum(weights)])
        self._corners, self._angles = corners, angles
        self._times: Array | None = None
        if along[-1] > 0:
            self._times = start + seconds * along / along[-1]

    @property
    def moves(self) -> bool:
        """True if the pose changes."""
        return self._times is not None

    def poses(self, times: Array) -> Array:
        """Return the poses at some times, s, shape (n, 7)."""
        if self._times is None:
            return np.repeat(self.end[None], len(times), axis=0)
        corners = self._corners
        poses = np.empty((len(times), 7))
        if len(corners) == 2:  # as in most ticks
            return self._poses_between(times, poses)
        for axis in range(3):
            poses[:, axis] = np.interp(times, self._times, corners[:, axis])
        if not self.turned:
            poses[:, 3:] = self.end[3:]
            return poses
        last = len(corners) - 2
        n = np.clip(np.searchsorted(self._times, times, side='right') - 1, 0, last)
        duration = self._times[n + 1] - self._times[n]
        share = np.clip((times - self._times[n]) / np.where(duration > 0, duration, 1.0), 0, 1)
        share = np.where(duration > 0, share, 1.0)
        poses[:, 3:] = _turned(corners[n, 3:], corners[n + 1, 3:], self._angles[n], share)
        return poses

    def _poses_between(self, times: Array, poses: Array) -> Array:
        """Write the poses between two corners at some times, s, to an array; return that."""
        assert self._times is not None
        (start, end), (first, last) = self._times, self._corners
        share = np.minimum(np.maximum((times - start) / (end - start), 0.0), 1.0)
        poses[:, :3] = (1 - share)[:, None] * first[:3] + share[:, None] * last[:3]
        poses[:, 3:] = last[3:]
        if self.turned:
            poses[:, 3:] = _turned(first[3:], last[3:], self._angles, share)
        return poses


# Numbers about a motion in one drift: the rotation, row by row, from the frame of the body to that
# of the state; a reference point after the drift, m; the matrix S, 1/s, and the velocity, m/s, of
# a material point, S y + velocity at y from the reference point.
MOTION = 24


def motion_rows(
    poses: Array,
    times: Array | None,
    origin: Array,
    reference: Array | None = None,
    turn: Array | None = None,
) -> Array:
    """
    Return the numbers about the motion of bodies in each of n drifts, shape (n, ..., MOTION).

    Parameters
    ----------
    poses
        At the start and after each drift, shape (n + 1, ..., 7).
    times
        Of these, s, shape (n + 1,); None: the bodies are at rest.
    origin
        Of the state, m.
    reference
        Point in the frame of the body, m; None: its origin.
    turn
        Rotation from another frame to that of the body; None: there is no other.

    """
    turning = times is not None and bool((poses[1:, ..., 3:] != poses[:-1, ..., 3:]).any())
    matrices = rotation_matrix(poses[..., 3:] if turning else poses[:1, ..., 3:])
    points = poses[..., :3] - origin
    if reference is not None:
        points = points + matrices @ reference
    if turn is not None:
        matrices = matrices @ turn
    rows: Array = np.zeros((len(poses) - 1, *poses.shape[1:-1], MOTION))
    after = matrices[1:] if turning else matrices
    rows[..., :9] = after.reshape(*after.shape[:-2], 9)
    rows[..., 9:12] = points[1:]
    if times is not None:
        h = np.diff(times)
        per_h = np.divide(1.0, h, out=np.zeros_like(h), where=h > 0)
        per_h = per_h.reshape(-1, *[1] * (poses.ndim - 1))
        if turning:
            turns = np.eye(3) - matrices[:-1] @ np.swapaxes(after, -2, -1)
            rows[..., 12:21] = turns.reshape(*turns.shape[:-2], 9) * per_h
        rows[..., 21:] = np.diff(points, axis=0) * per_h
    return rows


def extend_path(start: Pose, path: Sequence[Pose], target: Pose) -> tuple[Pose, ...]:
    """
    Return a path with one more waypoint at its end, thinned evenly to `MAX_WAYPOINTS`.

    Where there are too many, the waypoint is left out that leaves the shortest piece of path
    between its neighbours.  No piece becomes longer by that than 1/32 of the whole path.

    Parameters
    ----------
    start
        Where the path begins; not a waypoint itself.
    path
        Waypoints so far.
    target
        The new one; it is always kept.

    """
    extended = (*path, target)
    if len(extended) <= MAX_WAYPOINTS:
        return extended
    # Quaternions count as well, as if they were metres: a path may be a turn alone.
    lengths = np.linalg.norm(np.diff((start, *extended), axis=0), axis=1)
    left_out = int(np.argmin(lengths[:-1] + lengths[1:]))
    return extended[:left_out] + extended[left_out + 1 :]


def commanded_path(
    name: str,
    pose: Pose,
    path: Sequence[Pose],
    target: tuple[Sequence[float], Sequence[float] | None],
    size: float,
    sheet: Array,
) -> tuple[Pose, ...]:
    """
    Return a path, extended by a commanded pose.

    Parameters
    ----------
    name, pose, size
        Of the body: for errors; where it is; and distance of its surface from its origin, m.
    path
        Waypoints so far.
    target
        Position, m, and quaternion x y z w of any length but 0; None: it does not turn.
    sheet
        Position of the sheet, m, shape (3,).

    Raises
    ------
    ValueError
        The pose is not finite or too far away.

    """
    position, orientation = target
    place = checked_position(name, position, size, sheet)
    turned = (path[-1] if path else pose)[3:]
    if orientation is not None:
        turned = checked_orientation(f'the orientation of {name}', orientation)
    return extend_path(pose, path, (*place, *turned))


def checked_position(name: str, position: Sequence[float], size: float, sheet: Array) -> Vector:
    """
    Return a commanded position of a body, m.

    Parameters
    ----------
    name
        Of the body, for the error.
    position
        Three numbers, m.
    size
        Distance of the body's surface from its origin, m; inf: any position is near enough.
    sheet
        Position of the sheet, m, shape (3,).

    Raises
    ------
    ValueError
        The position is not finite, out of range, or too far from the sheet.

    """
    centre = checked_vector(f'{name} position', position, 'sphere.position')
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
