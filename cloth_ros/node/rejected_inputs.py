"""Count and report messages and requests that are rejected."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType

# Arguments of a log call: at most one message per place and 5 s, by the steady clock.
THROTTLE: dict[str, Any] = {
    'throttle_duration_sec': 5.0,
    'throttle_time_source_type': Clock(clock_type=ClockType.STEADY_TIME),
}


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
        self._counts: Counter[str] = Counter()

    def register(self, kind: str) -> None:
        """Report a kind of input from the start, even if nothing is rejected."""
        self._counts[kind] += 0

    def add(self, topic: str, reason: object) -> None:
        """Count a rejected message, and warn."""
        self.count(topic)
        # rclpy throttles by logger and line: each topic has a logger of its own.
        logger = self._loggers.setdefault(topic, self._log.get_child(topic.replace('/', '.')))
        logger.warning(f'rejected a message on {topic}: {reason}', **THROTTLE)

    def count(self, kind: str) -> None:
        """Count what was rejected, where the sender has been told the reason."""
        self._counts[kind] += 1

    def report(self) -> dict[str, object]:
        """Return how many were rejected, in total and by kind."""
        return {
            'rejected inputs': self._counts.total(),
            **{f'rejected inputs, {kind}': count for kind, count in self._counts.items()},
        }
