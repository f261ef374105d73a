"""One marker of a serialised MarkerArray: a list of points, or a pose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from ..model.grid import Array
from .cdr import STAMP, SerializedMessage
from .published_cloth import PublishedCloth

# Writes points, shape (count, length, 3), from a cloth and its positions, (rows, columns, 3).
WritePoints = Callable[[Array, PublishedCloth, Array], None]
# Writes a position, orientation x y z w and scale, shape (10,), from a cloth.
WritePose = Callable[[Array, PublishedCloth], None]


class MarkerWriter(Protocol):
    """A marker that is part of a serialised message, and what writes its numbers."""

    marker: Marker

    def place(self, number: int) -> None:
        """Put placeholders into the marker, different for each number."""

    def locate(self, message: SerializedMessage) -> None:
        """Find the placeholders; markers are located in their order in the message."""

    def bind(self, message: SerializedMessage) -> None:
        """Take views of the frozen message."""

    def write(self, cloth: PublishedCloth, positions: Array) -> None:
        """Write the present state; positions have the shape (rows, columns, 3)."""


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


def sentinel(number: int, count: int) -> list[float]:
    """
    Return numbers that occur nowhere else in the message, different for each `number`.

    Nor can a frame be named so: three of them in a row are not valid UTF-8.
    """
    return [1.0e17 + 1024.0 * (100 * number + i) for i in range(count)]


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

    def write(self, cloth: PublishedCloth, positions: Array) -> None:
        """Write the points."""
        self._write(self._view, cloth, positions)


class PoseMarker:
    """
    A marker that is drawn at a pose.

    Parameters
    ----------
    marker
        Of any type that has no points.
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

    def write(self, cloth: PublishedCloth, positions: Array) -> None:
        """Write the pose and the scale."""
        self._write(self._view, cloth)
