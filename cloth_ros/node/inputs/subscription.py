"""A subscription whose messages may be rejected."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from rclpy.subscription import Subscription

from ..context import Context
from ..qos import overridable_qos

M = TypeVar('M')


def subscribe(
    context: Context, kind: type[M], topic: str, handle: Callable[[M], None]
) -> Subscription:
    """
    Subscribe to a topic.

    Parameters
    ----------
    context
        Of the node.
    kind
        Message type.
    topic
        Relative name.
    handle
        Called with each message; a ValueError rejects the message, and its text says why.

    """
    context.rejected.register(topic)

    def receive(message: M) -> None:
        try:
            handle(message)
        except ValueError as error:
            context.rejected.add(topic, error)

    return context.node.create_subscription(kind, topic, receive, **overridable_qos())
