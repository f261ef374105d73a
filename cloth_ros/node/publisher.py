"""A publisher that neither delays the ticks nor ends the node, whatever DDS does."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from .context import Context
from .publish_bytes import publish_bytes
from .qos import overridable_qos
from .rejected_inputs import THROTTLE
from .shared_memory import SEGMENT


class TolerantPublisher:
    """
    Publish on a topic in the thread `Context.sender`; count and report messages that are not sent.

    DDS may block whoever publishes: for seconds where a subscriber on this machine hangs, for some
    tenths where one appears.  Messages wait meanwhile, as many as the queue of the topic holds or
    as fit into shared memory together; then the oldest are dropped.

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
        self._sender = context.sender
        self._waiting: deque[bytes] = deque()
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
        """Send a message or its bytes soon."""
        data = message if isinstance(message, bytes) else serialize_message(message)
        most = max(self._publisher.qos_profile.depth, SEGMENT // len(data), 1)
        dropped = 0
        with suppress(IndexError):  # the sender has taken the oldest meanwhile
            while len(self._waiting) >= most:
                self._waiting.popleft()
                dropped += 1
        self._waiting.append(data)
        if not dropped:
            self._sender.submit(self._send_oldest)
            return
        # The call that was to send the dropped message sends this one.
        self._unsent[self.topic] += dropped
        self._log.warning(
            f'messages on {self._name} were not sent: those before them took too long; a '
            'subscriber on this machine may hang',
            **THROTTLE,
        )

    def _send_oldest(self) -> None:
        """Send a message; warn if DDS has no room or time for it."""
        try:
            publish_bytes(self._publisher, self._waiting.popleft())
        except (IndexError, InvalidHandle):
            pass  # several were dropped for one larger message, or the topic was removed
        except rclpy_implementation.RCLError as error:
            self._unsent[self.topic] += 1
            self._log.warning(f'a message on {self._name} was not sent: {error}', **THROTTLE)
