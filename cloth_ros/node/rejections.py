"""Messages that were refused, counted and warned of."""

from __future__ import annotations

from collections import Counter
from typing import Any

WARNING_EVERY = 5.0  # s, between two warnings of one kind


class Rejections:
    """
    What was refused, by topic.

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
        self._counts[topic] += 1
        # rclpy throttles by logger and line: each topic has a logger of its own.
        logger = self._loggers.setdefault(topic, self._log.get_child(topic))
        logger.warning(
            f'refused a message on {topic}: {reason}', throttle_duration_sec=WARNING_EVERY
        )

    def report(self) -> dict[str, object]:
        """Return how many were refused."""
        topics = ('wind', 'sphere_pose', 'clock')
        return {
            'rejected inputs': self._counts.total(),
            **{f'rejected {topic}': self._counts[topic] for topic in topics},
        }
