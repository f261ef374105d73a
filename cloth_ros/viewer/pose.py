"""Position and orientation of a collider, in the conventions of ROS and of viser."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from viser import transforms

Vector = tuple[float, float, float]
Wxyz = tuple[float, float, float, float]
FARTHEST = 100.0  # m from the origin, of poses that the page may command


class Pose(NamedTuple):
    """
    Position and orientation.

    Attributes
    ----------
    position
        m.
    wxyz
        Unit quaternion, in the order of viser: w first.

    """

    position: Vector = (0.0, 0.0, 0.0)
    wxyz: Wxyz = (1.0, 0.0, 0.0, 0.0)

    @classmethod
    def of_message(cls, message: PoseMessage) -> Pose:
        """Return the pose of a message; not rotated if its quaternion is not valid."""
        at, turn = message.position, message.orientation
        return cls((at.x, at.y, at.z), unit((turn.w, turn.x, turn.y, turn.z)) or cls().wxyz)

    def message(self) -> PoseMessage:
        """Return the message."""
        w, x, y, z = self.wxyz
        position = Point(**dict(zip('xyz', self.position, strict=True)))
        return PoseMessage(position=position, orientation=Quaternion(x=x, y=y, z=z, w=w))

    def times(self, other: Pose) -> Pose:
        """Return what is `other` in the frame of this pose."""
        return _of_transform(_transform(self) @ _transform(other))

    def inverse(self) -> Pose:
        """Return the inverse."""
        return _of_transform(_transform(self).inverse())


def _transform(pose: Pose) -> transforms.SE3:
    return transforms.SE3(np.array((*pose.wxyz, *pose.position), float))


def _of_transform(transform: transforms.SE3) -> Pose:
    w, x, y, z, *position = transform.wxyz_xyz.tolist()
    a, b, c = position
    return Pose((a, b, c), (w, x, y, z))


def unit(wxyz: Sequence[float]) -> Wxyz | None:
    """Return a quaternion of unit length; None if that is not possible."""
    length = math.hypot(*wxyz)
    if not math.isfinite(length) or length < 1e-6:
        return None
    w, x, y, z = (float(each) / length for each in wxyz)
    return w, x, y, z


def commanded_pose(position: Sequence[float], wxyz: Sequence[float]) -> Pose | None:
    """Return the pose that the page commands; None if it is not finite or too far away."""
    turn = unit(wxyz)
    if turn is None or not all(abs(each) <= FARTHEST for each in position):
        return None
    x, y, z = map(float, position)
    return Pose((x, y, z), turn)
