"""Messages that were refused, counted and warned of."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType

# Between two warnings of one kind; on the clock that no one sets back.
THROTTLE: dict[str, Any] = {
    'throttle_duration_sec': 5.0,
    'throttle_time_source_type': Clock(clock_type=ClockType.STEADY_TIME),
}


class RejectedInputs:
    """
    What was refused, by topic; requests to set parameters under `parameters`.

    Parameters
    ----------
    log
        Where to warn.

    """

    def __init__(self, log: Any) -> None:
        self._log = log
        self._loggers: dict[str, Any] = {}
        self._counts: Counter[str] = Counter()

    def add(self, topic: str, reason: object) -> None:
        """Count a message, and warn of it."""
        self.count(topic)
        # rclpy throttles by logger and line: each topic has a logger of its own.
        logger = self._loggers.setdefault(topic, self._log.get_child(topic))
        logger.warning(f'refused a message on {topic}: {reason}', **THROTTLE)

    def count(self, kind: str) -> None:
        """Count what was refused, where whoever sent it has been told why."""
        self._counts[kind] += 1

    def report(self) -> dict[str, object]:
        """Return how many were refused."""
        kinds = ('wind', 'sphere_pose', 'clock', 'parameters')
        return {
            'rejected inputs': self._counts.total(),
            **{f'rejected {kind}': self._counts[kind] for kind in kinds},
        }
