"""
The system clock set back under a running node.

The C++ library that the wheels of ROS 2 are built with has no wait on the steady clock: it turns
the moment into one of the system clock.  When that is set back by an hour, timers and the executor
sleep an hour longer, whatever clock they follow.
"""

from __future__ import annotations

import threading
import time

from rclpy.exceptions import InvalidHandle
from rclpy.timer import Timer

# Between two looks, s: with a tick, it is less than solver.max_tick, so that no time is lost.
_EVERY = 0.05
_STEP = 0.02  # s, from which on the clock was set back, and not slowed down


def watch_for_clock_jumps(timer: Timer) -> None:
    """Wake the executor when the system clock was set back: resetting a timer does so."""
    threading.Thread(target=_watch, args=(timer,), daemon=True).start()


def _watch(timer: Timer) -> None:
    ahead = time.time() - time.monotonic()
    while True:
        time.sleep(_EVERY)  # on the steady clock
        before, ahead = ahead, time.time() - time.monotonic()
        if ahead < before - _STEP:
            try:
                timer.reset()
            except InvalidHandle:  # the node has ended
                return
