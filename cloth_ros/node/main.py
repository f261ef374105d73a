"""The command `cloth_node`: signals first, everything heavy after."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Stop:
    """
    What SIGINT and SIGTERM ask for.

    They raise KeyboardInterrupt while the node is being made and while it simulates, which may
    take long; elsewhere, in the middle of rclpy, they only leave word.

    Attributes
    ----------
    asked
        True once a signal has come.

    """

    def __init__(self) -> None:
        self.asked = False
        self._raising = True
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)

    def _ask(self, _: int, __: FrameType | None) -> None:
        self.asked = True
        if self._raising:
            self._raising = False
            raise KeyboardInterrupt

    def defer(self) -> None:
        """Raise no longer, from here on."""
        self._raising = False

    @contextmanager
    def interrupting(self) -> Iterator[None]:
        """Raise within this block."""
        self._raising = not self.asked
        try:
            yield
        finally:
            self._raising = False


def main(args: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    stop = Stop()
    if 'HOME' not in os.environ and 'ROS_LOG_DIR' not in os.environ:
        # Without either rclpy does not start; logs are worth less than the cloth.
        os.environ['ROS_LOG_DIR'] = tempfile.mkdtemp(prefix='cloth_ros-')
    try:
        from .cloth_node import run

        run(stop, args)
    except KeyboardInterrupt:
        pass
    except ModuleNotFoundError as error:
        print(
            f'cloth_node: there is no {error.name}; source ROS 2 Jazzy, or install its wheels: '
            "pip install 'cloth_ros[ros]'",
            file=sys.stderr,
        )
        return 2
    except SystemExit as error:
        print(f'cloth_node: {error}', file=sys.stderr)
        return 2
    return 0


if __name__ == '__main__':
    sys.exit(main())
