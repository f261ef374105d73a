"""Pins and colliders of a cloth, from one message of its markers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from visualization_msgs.msg import Marker, MarkerArray

from .pose import Pose

# Namespaces of markers that are no colliders.
_CLOTH = frozenset(('sheet', 'springs', 'wind', 'pins'))
_KINDS = {
    Marker.SPHERE: 'sphere',
    Marker.CUBE: 'box',
    Marker.CYLINDER: 'cylinder',
    Marker.TRIANGLE_LIST: 'mesh',
}
# A plane is drawn as a square of this thickness, as a share of its edge, this far, m, behind it.
_PLANE_THICKNESS, _PLANE_GAP = 0.005, 5e-4


class Shape(NamedTuple):
    """
    A part of a collider.

    Attributes
    ----------
    kind
        'sphere', 'box', 'cylinder' or 'mesh'.
    pose
        In the frame of the collider.
    size
        Extent along its x, y, z, m; of a cylinder, z is the axis.
    triangles
        Of a mesh, m, shape (count, 3, 3).
    opacity
        Below 1 for the ball of a gripper.

    """

    kind: str
    pose: Pose
    size: tuple[float, float, float]
    triangles: NDArray[np.float32]
    opacity: float = 1.0

    @property
    def is_plane(self) -> bool:
        """True for the square that represents a plane."""
        x, y, z = self.size
        return self.kind == 'box' and x == y and abs(z - _PLANE_THICKNESS * x) < 1e-9 * x


class Shapes(NamedTuple):
    """
    Pins and colliders at one time.

    Attributes
    ----------
    pins
        Pinned particles, m, shape (count, 3).
    pin_diameter
        m.
    colliders
        Pose and parts of each collider by its name.

    """

    pins: NDArray[np.float32]
    pin_diameter: float
    colliders: dict[str, tuple[Pose, list[Shape]]]


def _points(marker: Marker) -> NDArray[np.float32]:
    return np.array([(each.x, each.y, each.z) for each in marker.points], np.float32)


def _origin(shape: Shape) -> Pose:
    """Return the origin of a collider in the frame of its first part."""
    if not shape.is_plane:
        return Pose()
    return Pose((0.0, 0.0, shape.size[2] / 2 + _PLANE_GAP))


def read_shapes(message: MarkerArray) -> Shapes | None:
    """Return pins and colliders of a message; None if it shows nothing."""
    pins, diameter = np.empty((0, 3), np.float32), 0.0
    parts: dict[str, list[Shape]] = {}
    shown = False
    for marker in message.markers:
        if marker.action != Marker.ADD:
            continue
        shown = True
        scale = (marker.scale.x, marker.scale.y, marker.scale.z)
        if marker.ns == 'pins':
            pins, diameter = _points(marker).reshape(-1, 3), scale[0]
        elif marker.ns not in _CLOTH and marker.type in _KINDS:
            kind = _KINDS[marker.type]
            mesh = _points(marker) if kind == 'mesh' else np.empty(0, np.float32)
            pose, opacity = Pose.of_message(marker.pose), round(marker.color.a, 3)
            shape = Shape(kind, pose, scale, mesh.reshape(-1, 3, 3), opacity)
            parts.setdefault(marker.ns, []).append(shape)
    colliders = {}
    for name, shapes in parts.items():
        origin = shapes[0].pose.times(_origin(shapes[0]))
        inverse = origin.inverse()
        own = [shape._replace(pose=inverse.times(shape.pose)) for shape in shapes]
        colliders[name] = (origin, own)
    return Shapes(pins, diameter, colliders) if shown else None


class MarkerShapes:
    """
    Take single messages of markers when asked to.

    No permanent subscription: while there is one, the node builds the triangles of the sheet some
    thirty times per second, which nothing here needs.

    Parameters
    ----------
    node
        Owner of the subscription.
    topic
        Full name of the topic.

    """

    def __init__(self, node: Node, topic: str) -> None:
        self._node, self._topic = node, topic
        self._subscription: Subscription | None = None
        self._received: list[bytes] = []

    @property
    def waiting(self) -> bool:
        """True from a request until its message came."""
        return self._subscription is not None

    def request(self) -> None:
        """Subscribe until a message that shows something comes."""
        if self._subscription is None:
            self._received.clear()
            self._subscription = self._node.create_subscription(
                MarkerArray, self._topic, self._receive, 5, raw=True
            )

    def _receive(self, message: bytes) -> None:
        if len(self._received) < 5:
            self._received.append(message)

    def take(self) -> Shapes | None:
        """Return what a request has brought, once; end the subscription."""
        while self._received:
            shapes = read_shapes(deserialize_message(self._received.pop(0), MarkerArray))
            if shapes is not None:
                self.close()
                return shapes
        return None

    def close(self) -> None:
        """End the subscription."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None
