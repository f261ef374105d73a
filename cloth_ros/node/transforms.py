"""Transform vectors and points to the frame of the node, by tf2 if it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
from geometry_msgs.msg import Transform
from rclpy.node import Node
from rclpy.time import Time

from ..model.grid import rotation_matrix
from ..scene.parameter import format_value

Vector = tuple[float, float, float]


def transformed(vector: Vector, transform: Transform, *, is_point: bool) -> Vector:
    """Return a vector, or a point, in the target frame of a transform."""
    rotation = transform.rotation
    quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
    result = rotation_matrix(quaternion) @ np.array(vector)
    if is_point:
        shift = transform.translation
        result = result + np.array((shift.x, shift.y, shift.z))
    x, y, z = result.tolist()
    return (x, y, z)


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

    def to_own(self, vector: Vector, frame_id: str, *, is_point: bool) -> Vector:
        """
        Return a vector or point of `frame_id` in the node's frame; empty means the node's own.

        Raises
        ------
        ValueError
            tf2 is not installed, or knows no such transform.

        """
        if frame_id in ('', self._frame_id):
            return vector
        if self._tf2 is None:
            raise ValueError(
                f'the frame is {format_value(frame_id)}, but must be {self._frame_id!r} or empty '
                'where tf2 is not installed; transform it, or install ros-jazzy-tf2-ros'
            )
        try:
            # The latest: to wait for that of the stamp would delay the command.
            stamped = self._buffer.lookup_transform(self._frame_id, frame_id, Time())
        except self._tf2.TransformException as error:
            raise ValueError(
                f'the frame is {format_value(frame_id)}, from which tf2 knows no transform to '
                f'{self._frame_id!r} ({error}); publish the transform'
            ) from None
        return transformed(vector, stamped.transform, is_point=is_point)
