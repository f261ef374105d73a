"""A subscription whose messages may be rejected."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from ..context import Context
from ..qos import overridable_qos

M = TypeVar('M')


def subscribe(context: Context, kind: type[M], topic: str, handle: Callable[[M], None]) -> str:
    """
    Subscribe to a topic, and return its full name.

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

    context.node.create_subscription(kind, topic, receive, **overridable_qos())
    name: str = context.node.resolve_topic_name(topic)
    return name
