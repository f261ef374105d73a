"""A publisher whose messages may fail to be sent without ending the node."""

from __future__ import annotations

from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import QoSProfile

from .context import Context
from .qos import overridable_qos
from .rejected_inputs import THROTTLE


class TolerantPublisher:
    """
    Publish on a topic; count and report messages that cannot be sent.

    Parameters
    ----------
    context
        Of the node.
    kind
        Message type.
    topic
        Name, which may be relative or private.
    profile
        Quality of service, if it is not the usual one; its queue can be overridden in any case.

    Attributes
    ----------
    topic
        Its full name.

    """

    def __init__(
        self, context: Context, kind: type, topic: str, profile: QoSProfile | None = None
    ) -> None:
        self._node = context.node
        self._publisher = context.node.create_publisher(kind, topic, **overridable_qos(profile))
        self.topic = self._publisher.topic_name
        self._name = topic.removeprefix('~').removeprefix('/')
        self._unsent = context.unsent
        self._log = context.node.get_logger().get_child(self._name)

    def destroy(self) -> None:
        """Remove the topic; nothing can be published afterwards."""
        self._node.destroy_publisher(self._publisher)

    @property
    def subscribers(self) -> int:
        """Number of subscribers."""
        return int(self._publisher.get_subscription_count())

    @property
    def wanted(self) -> bool:
        """True if there is a subscriber."""
        return self.subscribers > 0

    def publish(self, message: Any) -> None:
        """Publish a message or its bytes; warn if DDS has no room or time for it."""
        try:
            self._publisher.publish(message)
        except rclpy_implementation.RCLError as error:
            self._unsent[self.topic] += 1
            self._log.warning(f'a message on {self._name} was not sent: {error}', **THROTTLE)
