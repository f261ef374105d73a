"""
Wake the executor when the system clock is set back.

The C++ library that the wheels of ROS 2 are built with cannot wait on the steady clock: it
converts the end of a wait to a time of the system clock.  When that is set back by an hour, timers
and the executor wait an hour longer, for any clock.
"""

from __future__ import annotations

import threading
import time

from rclpy.exceptions import InvalidHandle
from rclpy.timer import Timer

# s, from one check to the next: with a tick less than solver.max_tick, so that no time is lost.
_PERIOD = 0.05
_STEP = 0.02  # s, by which the clock must be set back; less may be a clock that is slowed down


def watch_for_clock_jumps(timer: Timer) -> None:
    """Reset a timer, which wakes the executor, whenever the system clock was set back."""
    threading.Thread(target=_watch, args=(timer,), daemon=True).start()


def _watch(timer: Timer) -> None:
    offset = time.time() - time.monotonic()
    while True:
        time.sleep(_PERIOD)  # on the steady clock
        before, offset = offset, time.time() - time.monotonic()
        if offset < before - _STEP:
            try:
                timer.reset()
            except InvalidHandle:  # the node has ended
                return
