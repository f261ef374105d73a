"""The executor of a node: the one that takes the least time per message."""

from __future__ import annotations

from rclpy.executors import Executor, SingleThreadedExecutor


def make_executor() -> Executor:
    """
    Return an executor of one thread.

    rclpy's events executor takes a third of the processor time per message of the usual one, which
    checks every entity each time.  The first releases of Jazzy do not have it.
    """
    try:
        from rclpy.experimental import EventsExecutor  # type: ignore[attr-defined]
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()
