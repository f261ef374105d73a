"""A node that rejects messages on /clock that are not valid times."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.time_source import CLOCK_TOPIC
from rosgraph_msgs.msg import Clock

from ..scene.parameter import invalid_value_error


def check_time(message: Clock) -> None:
    """Raise ValueError for a time before 1970, and for one that a stamp cannot carry."""
    time = message.clock
    if time.sec < 0:
        raise invalid_value_error('clock.sec', time.sec, 'at least 0', 'publish a time after 1970')
    if time.nanosec >= 1_000_000_000:
        raise invalid_value_error(
            'clock.nanosec', time.nanosec, 'below 1e9', 'carry it over to sec'
        )


class ValidatedClockNode(Node):
    """
    A node that checks messages on /clock, and is told when /clock has moved.

    rclpy's time source subscribes through `create_subscription` whenever `use_sim_time` becomes
    true, and ends the node with an exception when a message is not a valid time.
    """

    def create_subscription(  # type: ignore[no-untyped-def]
        self, msg_type: type, topic: str, callback: Callable[..., None], *args: Any, **others: Any
    ):
        """Subscribe; messages on /clock are checked first."""

        def checked(message: Clock) -> None:
            try:
                check_time(message)
            except ValueError as error:
                self.reject(topic, error)
            else:
                callback(message)
                self.clock_moved()

        handle = checked if topic == CLOCK_TOPIC else callback
        return super().create_subscription(msg_type, topic, handle, *args, **others)

    def clock_moved(self) -> None:
        """Handle that the node's clock has taken the time of a message on /clock."""
        raise NotImplementedError

    def reject(self, topic: str, reason: object) -> None:
        """Record that a message was rejected."""
        raise NotImplementedError
