"""Markers of grippers: a ball of the radius, whose colour shows whether it holds anything."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from ..model.grid import Array
from .cdr import SerializedMessage
from .marker import MarkerState, MarkerWriter, PoseMarker, new_marker
from .published_cloth import PublishedCloth

# Red, green, blue and opacity: what is held can be seen within the ball.
_OPEN, _HOLDING = (0.95, 0.75, 0.2, 0.35), (0.25, 0.7, 0.35, 0.55)


class _GripperMarker(PoseMarker):
    """The marker of one gripper."""

    def __init__(self, name: str, frame_id: str) -> None:
        self._name = name
        r, g, b, a = _OPEN
        colour = ColorRGBA(r=r, g=g, b=b, a=a)
        marker = new_marker(name, Marker.SPHERE, colour, 1.0, frame_id)
        super().__init__(marker, self._write_pose)

    def bind(self, message: SerializedMessage) -> None:
        """Take views of position, orientation and scale, and of the colour behind them."""
        super().bind(message)
        self._colour = message.view(self._offset + self._view.nbytes, np.float32, (4,))

    def write(self, state: MarkerState) -> None:
        """Write pose, scale and colour."""
        super().write(state)
        self._colour[:] = _HOLDING if len(state.cloth.grippers[self._name].held) else _OPEN

    def _write_pose(self, view: Array, state: MarkerState) -> None:
        gripper = state.cloth.grippers[self._name]
        view[:3], view[3:7] = gripper.position, gripper.orientation
        view[7:] = 2 * gripper.parameters.radius


def gripper_markers(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield the marker of each gripper; its namespace is the gripper's name."""
    for name in cloth.grippers:
        yield _GripperMarker(name, cloth.scene.frame_id)
