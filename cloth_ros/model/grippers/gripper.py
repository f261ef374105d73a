"""A gripper: its motion in an advance, the particles that it holds, and the forces on it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...scene.gripper import GripperParameters
from ...scene.quaternion import Quaternion, rotation_matrix
from ..grid import Array
from ..inputs import Pose, Vector
from ..kinematic_path import MOTION, KinematicPath, motion_rows

# s, over which the pull of the sheet is averaged that decides whether a particle slips out: longer
# than the springs oscillate.
_AVERAGED = 0.01


class GripperSnapshot(NamedTuple):
    """Everything about a gripper that later results depend on; see `Gripper`."""

    parameters: GripperParameters
    pose: Pose
    held: Array
    local: Array
    pull: Array
    total: tuple[float, ...]
    work: float


class Gripper:
    """
    A gripper that moves as commanded.

    Attributes
    ----------
    parameters
        From the scene.
    pose
        Origin in the world, m, and orientation, x y z w.
    held
        Numbers of the particles that it holds, row · columns + column, ascending, shape (n,).
    local
        Their positions in its frame, m, shape (n, 3).
    pull
        Force of the sheet, and of gravity, on each, averaged over some milliseconds, N for cells
        of 1 kg, shape (n, 3).
    work
        That it has done on the sheet since this was reset, J for cells of 1 kg.

    """

    def __init__(self, parameters: GripperParameters) -> None:
        self.parameters, self.name = parameters, parameters.name
        self.pose: Pose = parameters.pose
        self._hold(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)))
        self.path = KinematicPath([self.pose], 0.0, 1.0, 1.0)
        self._seconds, self.work = 0.0, 0.0
        self._total = [0.0] * 6  # impulse, and moment about the origin, in this advance

    @property
    def position(self) -> Vector:
        """Origin in the world, m."""
        return self.pose[:3]

    @property
    def orientation(self) -> Quaternion:
        """Orientation in the world, quaternion x y z w."""
        return self.pose[3:]

    # Particles

    def distances(self, points: Array) -> Array:
        """Return the distances of points in the world, m, shape (n, 3), from the origin."""
        away: Array = np.linalg.norm(points - np.array(self.position), axis=1)
        return away

    def take(self, numbers: Array, points: Array) -> None:
        """Hold also these particles, which are at points in the world, m, shape (n, 3)."""
        held = np.concatenate([self.held, numbers])
        local = np.concatenate([self.local, self.to_local(points)])
        pull = np.concatenate([self.pull, np.zeros((len(numbers), 3))])
        order = np.argsort(held)
        self._hold(held[order], local[order], pull[order])

    def to_local(self, points: Array) -> Array:
        """Return points in the world, m, shape (n, 3), in the frame of the gripper."""
        local: Array = (points - self.position) @ rotation_matrix(self.orientation)
        return local

    def keep(self, kept: Array) -> None:
        """Release the particles where `kept`, bool, shape (n,), is False."""
        self._hold(self.held[kept], self.local[kept], self.pull[kept])

    def place(self, points: Array) -> None:
        """Hold the particles at other points in the world, m, shape (n, 3)."""
        self._hold(self.held, self.to_local(points), self.pull)

    def _hold(self, held: Array, local: Array, pull: Array) -> None:
        """Arrays are replaced, never changed: snapshots have them too."""
        self.held, self.local, self.pull = held, local, pull

    # Motion

    def begin_advance(self, time: float, seconds: float, waypoints: tuple[Pose, ...]) -> None:
        """Start on a path of `seconds` from `time`, s."""
        self._seconds, self._total = seconds, [0.0] * 6
        if waypoints or self.path.moves:
            reach = float(np.linalg.norm(self.local, axis=1).max(initial=self.parameters.radius))
            self.path = KinematicPath([self.pose, *waypoints], time, seconds, reach)

    def move_to(self, pose: Array) -> None:
        """Take a pose, shape (7,)."""
        x, y, z, a, b, c, d = pose.tolist()
        self.pose = (x, y, z, a, b, c, d)

    def end_advance(self) -> None:
        """Take the pose at the end of the path."""
        if self.path.moves:
            self.move_to(self.path.end)
            self.path = KinematicPath([self.pose], 0.0, 1.0, 1.0)

    def poses(self, times: Array) -> Array:
        """Return the poses at some times in the advance, s, shape (n, 7)."""
        if not self.path.moves:
            return np.repeat(np.array([self.pose]), len(times), axis=0)
        return self.path.poses(times)

    def velocities_at(self, time: float) -> Array:
        """Return the velocities of the held particles just after a time, m/s, shape (n, 3)."""
        if not self.path.moves:
            return np.zeros_like(self.local)
        times = np.array([time, time + self._seconds / 1024])
        row = motion_rows(self.path.poses(times), times, np.zeros(3))[0]
        arms = self.local @ row[:9].reshape(3, 3).T
        velocities: Array = arms @ row[12:21].reshape(3, 3).T + row[21:MOTION]
        return velocities

    # Forces

    def add(self, impulse: Array, moment: Array, work: float) -> None:
        """Add the impulse on the sheet, its moment about the origin, and the work of a batch."""
        for n, each in enumerate([*impulse.tolist(), *moment.tolist()]):
            self._total[n] += each
        self.work += work

    def wrench(self, cell_mass: float) -> tuple[Vector, Vector]:
        """Return force, N, and torque about the origin, N m, of the sheet on it: their means."""
        if not self._seconds:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        # The impulses are those on the sheet.
        a, b, c, d, e, f = [-cell_mass / self._seconds * each for each in self._total]
        return (a, b, c), (d, e, f)

    def slip(self, impulses: Array, seconds: float, cell_mass: float) -> bool:
        """
        Release the particle that is pulled hardest, if the whole grip is pulled too hard.

        Parameters
        ----------
        impulses
            Of the sheet and of gravity on each particle in a batch, kg m/s for cells of 1 kg.
        seconds
            Duration of the batch.
        cell_mass
            kg.

        Returns
        -------
        bool
            True if a particle was released.

        """
        share = -math.expm1(-seconds / _AVERAGED)
        self.pull = self.pull + share * (impulses / seconds - self.pull)
        force = cell_mass * float(np.linalg.norm(self.pull.sum(axis=0)))
        # False for NaN, and if nothing is held.
        if not force > self.parameters.slip_force:
            return False
        kept = np.ones(len(self.held), bool)
        kept[np.argmax(np.linalg.norm(self.pull, axis=1))] = False
        self.keep(kept)
        return True

    # Snapshots

    def snapshot(self) -> GripperSnapshot:
        """Return everything that later results depend on."""
        return GripperSnapshot(
            self.parameters, self.pose, self.held, self.local, self.pull, tuple(self._total),
            self.work,
        )  # fmt: skip

    def restore(self, snapshot: GripperSnapshot) -> None:
        """Return to a snapshot."""
        self.pose, self.work = snapshot.pose, snapshot.work
        self._total = list(snapshot.total)
        self._hold(snapshot.held, snapshot.local, snapshot.pull)
