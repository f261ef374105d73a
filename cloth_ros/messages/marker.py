"""One marker of a serialised MarkerArray: a list of points, a pose, or both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

import numpy as np
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from ..model.contact.collider import Collider
from ..model.grid import Array
from .cdr import STAMP, SerializedMessage, sentinel
from .published_cloth import PublishedCloth


class MarkerState(NamedTuple):
    """
    What markers are written from, read once for all of them.

    Attributes
    ----------
    cloth
        The cloth.
    positions
        Its positions, m, shape (rows, columns, 3).
    colliders
        Its colliders by name.

    """

    cloth: PublishedCloth
    positions: Array
    colliders: Mapping[str, Collider]


# Writes points, shape (count, length, 3).
WritePoints = Callable[[Array, MarkerState], None]
# Writes a position, orientation x y z w and scale, shape (10,).
WritePose = Callable[[Array, MarkerState], None]


class MarkerWriter(Protocol):
    """A marker that is part of a serialised message, and what writes its numbers."""

    marker: Marker

    def place(self, number: int) -> None:
        """Put placeholders into the marker, different for each number."""

    def locate(self, message: SerializedMessage) -> None:
        """Find the placeholders; markers are located in their order in the message."""

    def bind(self, message: SerializedMessage) -> None:
        """Take views of the frozen message."""

    def write(self, state: MarkerState) -> None:
        """Write the present state."""


def new_marker(
    namespace: str, kind: int, colour: ColorRGBA, scale: float, frame_id: str
) -> Marker:
    """Return a marker with a placeholder for its stamp."""
    marker = Marker(
        header=Header(stamp=STAMP, frame_id=frame_id),
        ns=namespace,
        type=kind,
        color=colour,
        scale=Vector3(x=scale, y=scale, z=scale),
    )
    marker.pose.orientation.w = 1.0
    return marker


def _points(numbers: list[float]) -> list[Point]:
    return [
        Point(x=x, y=y, z=z)
        for x, y, z in zip(numbers[::3], numbers[1::3], numbers[2::3], strict=True)
    ]


class PointsMarker:
    """
    A marker with a list of points.

    Parameters
    ----------
    marker
        Without points.
    length
        Points of one element: 3 of a triangle, 2 of a line.
    count
        Number of elements, more than 0.
    write
        Writes the points.

    """

    def __init__(self, marker: Marker, length: int, count: int, write: WritePoints) -> None:
        self.marker = marker
        self._length, self._count, self._write = length, count, write

    def place(self, number: int) -> None:
        """Put one element of placeholders into the marker."""
        numbers = sentinel(number, 3 * self._length)
        self.marker.points = _points(numbers)
        self._placeholder = np.array(numbers).tobytes()

    def locate(self, message: SerializedMessage) -> None:
        """Repeat the element."""
        self._offset = message.repeat(self._placeholder, self._length, self._count)

    def bind(self, message: SerializedMessage) -> None:
        """Take a view of the points."""
        self._view = message.view(self._offset, np.float64, (self._count, self._length, 3))

    def write(self, state: MarkerState) -> None:
        """Write the points."""
        self._write(self._view, state)


class PoseMarker:
    """
    A marker that is drawn at a pose.

    Parameters
    ----------
    marker
        Of any type; one with points is a `PosedPointsMarker`.
    write
        Writes the pose and the scale.

    """

    def __init__(self, marker: Marker, write: WritePose) -> None:
        self.marker, self._write = marker, write

    def place(self, number: int) -> None:
        """Put a placeholder into the position."""
        numbers = sentinel(number, 3)
        self.marker.pose.position = _points(numbers)[0]
        self._placeholder = np.array(numbers).tobytes()

    def locate(self, message: SerializedMessage) -> None:
        """Find the position; orientation and scale follow it."""
        self._offset = message.find(self._placeholder)

    def bind(self, message: SerializedMessage) -> None:
        """Take a view of position, orientation and scale."""
        self._view = message.view(self._offset, np.float64, (10,))

    def write(self, state: MarkerState) -> None:
        """Write the pose and the scale."""
        self._write(self._view, state)


class PosedPointsMarker:
    """
    A marker with a list of points in the frame of its pose.

    Parameters
    ----------
    pose, points
        Of the same marker.

    """

    def __init__(self, pose: PoseMarker, points: PointsMarker) -> None:
        self.marker = pose.marker
        self._pose, self._points = pose, points

    def place(self, number: int) -> None:
        """Put placeholders into the position and into the points."""
        self._pose.place(number)
        self._points.place(-1 - number)  # no other marker has a negative number

    def locate(self, message: SerializedMessage) -> None:
        """Find the position, and the points behind it."""
        self._pose.locate(message)
        self._points.locate(message)

    def bind(self, message: SerializedMessage) -> None:
        """Take views of both."""
        self._pose.bind(message)
        self._points.bind(message)

    def write(self, state: MarkerState) -> None:
        """Write both."""
        self._pose.write(state)
        self._points.write(state)
