"""Transform vectors and points to the frame of the node, by tf2 if it is installed."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Transform
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.time import Time

from ..scene.parameter import format_value, one_line
from ..scene.quaternion import Quaternion, Vector, checked_orientation, product, rotated

Pose = tuple[Vector, Quaternion]

# s, by which the latest transform of a frame may be older than the time of a tick.
STALE = 0.5


def transformed(vector: Vector, transform: Transform, *, is_point: bool) -> Vector:
    """Return a vector, or a point, in the target frame of a transform."""
    x, y, z = rotated(_rotation(transform), vector)
    if is_point:
        shift = transform.translation
        return (x + shift.x, y + shift.y, z + shift.z)
    return (x, y, z)


def transformed_pose(position: Vector, orientation: Quaternion, transform: Transform) -> Pose:
    """Return a pose, with a unit quaternion, in the target frame of a transform."""
    turned = product(_rotation(transform), orientation)
    return transformed(position, transform, is_point=True), turned


def _rotation(transform: Transform) -> Quaternion:
    rotation = transform.rotation
    quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
    return checked_orientation('the rotation of the transform', quaternion)


class Transforms:
    """
    Transform vectors and points to the frame of a node.

    Parameters
    ----------
    node
        Where transforms are received.
    frame_id
        Frame of the node.

    """

    def __init__(self, node: Node, frame_id: str) -> None:
        self._frame_id = frame_id
        self._tf2: Any = None
        self._listener: Any = None
        try:
            import tf2_ros
        except ImportError:
            return
        # From the start: transforms that are published before a message must be known by then.
        self._tf2, self._node = tf2_ros, node
        self.discard()

    def discard(self) -> None:
        """
        Discard all transforms: time has jumped back.

        A buffer accepts none that are older than those it has, and does not notice the jump
        itself.  Static transforms are sent again to a new listener.
        """
        if self._tf2 is None:
            return
        if self._listener is not None:
            self._listener.unregister()
        self._buffer = self._tf2.Buffer()
        self._listener = self._tf2.TransformListener(self._buffer, self._node)

    def is_own(self, frame_id: str) -> bool:
        """Return True for the frame of the node, for which an empty name stands as well."""
        return frame_id in ('', self._frame_id)

    def to_own(self, vector: Vector, frame_id: str, *, is_point: bool) -> Vector:
        """
        Return a vector or point of `frame_id` in the node's frame; empty means the node's own.

        Raises
        ------
        ValueError
            tf2 is not installed, or knows no such transform.

        """
        if self.is_own(frame_id):
            return vector
        # The latest: to wait for that of the stamp would delay the command.
        return transformed(vector, self._latest(frame_id).transform, is_point=is_point)

    def pose_to_own(self, position: Vector, orientation: Quaternion, frame_id: str) -> Pose:
        """
        Return a pose in `frame_id` as one in the node's frame; empty means the node's own.

        Parameters
        ----------
        position
            m.
        orientation
            Quaternion x y z w of any length but zero.
        frame_id
            Where the pose is given.

        Raises
        ------
        ValueError
            The quaternion is zero or not finite, tf2 is not installed, or it knows no such
            transform.

        """
        unit = checked_orientation('the orientation', orientation)
        if self.is_own(frame_id):
            return position, unit
        return transformed_pose(position, unit, self._latest(frame_id).transform)

    def frame_at(self, frame_id: str, time: int) -> Transform:
        """
        Return the transform from a frame to that of the node at a time, ns.

        The latest transform stands for one that is not known yet, unless it is too old.

        Raises
        ------
        ValueError
            tf2 is not installed, it knows no such transform, or the transform is too old.

        """
        self._require_tf2(frame_id)
        try:
            at = Time(nanoseconds=time, clock_type=ClockType.ROS_TIME)
            return self._buffer.lookup_transform(self._frame_id, frame_id, at).transform
        except self._tf2.ExtrapolationException:
            stamped = self._latest(frame_id)
        except self._tf2.TransformException as error:
            raise self._unknown(frame_id, error) from None
        age = 1e-9 * (time - Time.from_msg(stamped.header.stamp).nanoseconds)
        if abs(age) > STALE:
            relation = 'older' if age > 0 else 'newer'
            raise ValueError(
                f'the latest transform from {format_value(frame_id)} to {self._frame_id!r} is '
                f'more than {STALE:g} s {relation} than the tick; publish it, with the same clock'
            )
        return stamped.transform

    def _latest(self, frame_id: str) -> Any:
        self._require_tf2(frame_id)
        try:
            return self._buffer.lookup_transform(self._frame_id, frame_id, Time())
        except self._tf2.TransformException as error:
            raise self._unknown(frame_id, error) from None

    def _require_tf2(self, frame_id: str) -> None:
        if self._tf2 is None:
            raise ValueError(
                f'the frame is {format_value(frame_id)}, but must be {self._frame_id!r} or empty '
                'where tf2 is not installed; transform it, or install ros-jazzy-tf2-ros'
            )

    def _unknown(self, frame_id: str, error: Exception) -> ValueError:
        return ValueError(
            f'the frame is {format_value(frame_id)}, from which tf2 knows no transform to '
            f'{self._frame_id!r} ({one_line(str(error))}); publish the transform'
        )
