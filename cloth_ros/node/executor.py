"""The executor that takes the least time for a message."""

from __future__ import annotations

from rclpy.executors import Executor, SingleThreadedExecutor


def make_executor() -> Executor:
    """
    Return an executor of one thread.

    rclpy's events executor takes a third of the processor time of the usual one for a command,
    which looks at every entity each time; the first releases of Jazzy are without it.
    """
    try:
        from rclpy.experimental import EventsExecutor  # type: ignore[attr-defined]
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()
