"""When the cloth ticks: by the wall clock, or by /clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

_JUMP = 1.0  # s, from which on a step of /clock is taken for a jump, but for slow ticks:
_JUMP_TICKS = 3  # periods that are none
_RECENT = 5  # ticks, from which the step of /clock is told


class Tick(NamedTuple):
    """
    A tick.

    Attributes
    ----------
    now, elapsed
        When it is and how long after the one before, s, by the clock that ticks follow.
    wall
        The same by the wall clock, s.
    jump
        By what /clock has jumped, s, or what it was first; None if it has not.  `elapsed` is then
        0: that time was never there.

    """

    now: float
    elapsed: float
    wall: float
    jump: float | None


class TickClock:
    """
    The timer of the ticks.

    The wall clock is the steady one, which no one sets back; with simulated time ticks follow
    /clock.

    Parameters
    ----------
    node
        Whose timer, and whose parameter `use_sim_time`.
    tick
        What to call.

    Attributes
    ----------
    steady
        The steady clock.

    """

    def __init__(self, node: Node, tick: Callable[[], None]) -> None:
        self.steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._node, self._call = node, tick
        self._clock: Clock | None = None
        self._rate = 0.0
        self._timer: Any = None
        self._intervals: deque[float] = deque(maxlen=_RECENT)

    def start(self, rate: float) -> bool:
        """Begin, anew where the rate, Hz, or the clock has changed; return if the clock has."""
        # Not what is only true as a whole number or a string: rclpy then follows no /clock.
        simulated = self._node.get_parameter('use_sim_time').value is True
        clock = self._node.get_clock() if simulated else self.steady
        changed = clock is not self._clock
        if not changed and rate == self._rate:
            return False
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        if changed:
            self._clock = clock
            self._last = clock.now().nanoseconds
            self._last_steady = self.steady.now().nanoseconds
            self._intervals.clear()
        self._rate = rate
        self._timer = self._node.create_timer(1 / rate, self._call, clock=clock)
        return changed

    def tick(self) -> Tick:
        """Return what is known of the tick that is now."""
        assert self._clock is not None
        now, steady = self._clock.now().nanoseconds, self.steady.now().nanoseconds
        last, self._last = self._last, now
        wall, self._last_steady = 1e-9 * (steady - self._last_steady), steady
        elapsed, jump = 1e-9 * (now - last), None
        longest = max(_JUMP, _JUMP_TICKS / self._rate)
        if self.simulated and (last == 0 or not 0 <= elapsed <= longest):
            elapsed, jump = 0.0, elapsed
        else:
            self._intervals.append(elapsed)
        return Tick(1e-9 * now, elapsed, wall, jump)

    @property
    def simulated(self) -> bool:
        """True if ticks follow /clock."""
        return self._clock is not self.steady

    @property
    def period(self) -> float:
        """Time between two ticks, s: that of the rate, or of a /clock that comes more rarely."""
        period = 1 / self._rate
        return max(period, min(self._intervals, default=period)) if self.simulated else period

    @property
    def quiet(self) -> float:
        """Wall-clock time since the last tick, s."""
        return 1e-9 * (self.steady.now().nanoseconds - self._last_steady)
