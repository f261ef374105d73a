"""Count and report messages and requests that are rejected."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType

_REQUESTS = 'requests to set parameters'
# Arguments of a log call: at most one message per place and 5 s, by the steady clock.
THROTTLE: dict[str, Any] = {
    'throttle_duration_sec': 5.0,
    'throttle_time_source_type': Clock(clock_type=ClockType.STEADY_TIME),
}


def _messages_on(topic: str) -> str:
    return f'messages on {topic}'


class RejectedInputs:
    """
    Number of rejected messages by topic, and of rejected requests.

    Parameters
    ----------
    log
        Logger of the node.

    """

    def __init__(self, log: Any) -> None:
        self._log = log
        self._loggers: dict[str, Any] = {}
        self._counts: Counter[str] = Counter({_REQUESTS: 0})

    def register(self, topic: str) -> None:
        """Report a topic from the start, even if no message on it is rejected."""
        self._counts[_messages_on(topic)] += 0

    def unregister(self, topic: str) -> None:
        """Report a topic no longer that the node does not listen to, unless it was rejected."""
        if not self._counts[_messages_on(topic)]:
            del self._counts[_messages_on(topic)]

    def add(self, topic: str, reason: object) -> None:
        """Count a rejected message, and warn."""
        self._counts[_messages_on(topic)] += 1
        # rclpy throttles by logger and line: each topic has a logger of its own.
        name = topic.strip('/').replace('/', '.')
        logger = self._loggers.setdefault(topic, self._log.get_child(name))
        logger.warning(f'rejected a message on {topic}: {reason}', **THROTTLE)

    def count_request(self) -> None:
        """Count a rejected request to set parameters; the sender has been told the reason."""
        self._counts[_REQUESTS] += 1

    def report(self) -> dict[str, object]:
        """Return how many were rejected, in total and by kind."""
        return {
            'rejected inputs': self._counts.total(),
            **{f'rejected {kind}': count for kind, count in self._counts.items()},
        }
