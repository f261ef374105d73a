"""What the node publishes."""

from __future__ import annotations

from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from ..messages.markers import MarkersMessage, deletion
from ..messages.particles import ParticlesMessage
from ..model import Cloth
from ..scene import Scene
from .qos import overridable_qos
from .rejected_inputs import THROTTLE


class Output:
    """
    A topic, on which a message may fail to be sent.

    Attributes
    ----------
    topic
        Its name.
    unsent
        How many messages were not sent.

    """

    def __init__(self, node: Node, kind: type, topic: str) -> None:
        self._publisher = node.create_publisher(kind, topic, **overridable_qos())
        self.topic = self._publisher.topic_name
        self.unsent = 0
        self._name = topic.rpartition('/')[2]
        self._log = node.get_logger().get_child(self._name)

    @property
    def wanted(self) -> bool:
        """True if someone subscribes."""
        return self._publisher.get_subscription_count() > 0

    def publish(self, message: Any) -> None:
        """Publish, or warn: what DDS has no room or time for is worth less than the cloth."""
        try:
            self._publisher.publish(message)
        except rclpy_implementation.RCLError as error:
            self.unsent += 1
            self._log.warning(f'a message on {self._name} was not sent: {error}', **THROTTLE)


class StatePublisher:
    """
    The state of the cloth, as particles at each tick and as markers at their rate.

    Attributes
    ----------
    particles, markers
        The topics.

    """

    def __init__(self, node: Node, scene: Scene) -> None:
        self.particles = Output(node, PointCloud2, '~/particles')
        self.markers = Output(node, MarkerArray, '~/markers')
        self._particles = ParticlesMessage(scene.sheet.rows, scene.sheet.columns, scene.frame_id)
        self._markers: MarkersMessage | None = None
        self._shown: frozenset[str] = frozenset()
        self._next_markers = 0.0

    @property
    def unsent(self) -> int:
        """How many messages were not sent, on both."""
        return self.particles.unsent + self.markers.unsent

    def change_scene(self) -> None:
        """Make the markers anew."""
        self._markers = None

    def restart_clock(self) -> None:
        """Publish markers at the next tick, whatever its time."""
        self._next_markers = 0.0

    def publish(self, cloth: Cloth, now: float, stamp: int) -> None:
        """Publish a state at a time, s, stamped in ns, where someone subscribes."""
        seconds, nanoseconds = divmod(stamp, 1_000_000_000)
        if self.particles.wanted:
            self.particles.publish(self._particles.serialise(cloth, seconds, nanoseconds))
        if self._markers_due(cloth.scene, now) and self.markers.wanted:
            if self._markers is None:
                self._markers = MarkersMessage(cloth)
                vanished = self._shown - self._markers.namespaces
                if vanished:
                    self.markers.publish(deletion(vanished, cloth.scene.frame_id))
                self._shown = self._markers.namespaces
            self.markers.publish(self._markers.serialise(cloth, seconds, nanoseconds))

    def _markers_due(self, scene: Scene, now: float) -> bool:
        # Half a tick of slack: a tick that is early by its jitter is the one that was meant.
        if scene.markers.rate == 0 or now < self._next_markers - 0.5 / scene.rate:
            return False
        self._next_markers = max(self._next_markers + 1 / scene.markers.rate, now)
        return True
