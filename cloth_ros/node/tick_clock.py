"""Clock of the ticks: the steady wall clock, or /clock with `use_sim_time`."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.time_source import CLOCK_TOPIC

# A step of /clock is a jump if it is longer than this, s, and than this many periods of the ticks.
_JUMP = 1.0
_JUMP_PERIODS = 3
_RECENT = 5  # ticks, from which the usual step of /clock is determined
_SILENCE = 10**9  # ns of wall-clock time without a message, from which on /clock counts as silent


class Tick(NamedTuple):
    """
    One tick.

    Attributes
    ----------
    now, elapsed
        Time, and time since the last tick, s, by the clock that ticks follow.
    wall
        Wall-clock time since the last tick, s.
    jump
        Time by which /clock has jumped, s, or its first value; None if it has not jumped.  In case
        of a jump `elapsed` is 0: nothing is to be simulated for it.

    """

    now: float
    elapsed: float
    wall: float
    jump: float | None


class TickClock:
    """
    Calls for a tick once a period of the clock that the cloth follows.

    That is the steady wall clock, which is never set back, with a timer; or, with simulated time,
    /clock, whose messages `clock_moved` reports.  A timer on /clock would not do: rclpy's events
    executor may call it twice for one message where two arrive together, then not for the next.

    Parameters
    ----------
    node
        Owner of the timer and of the parameter `use_sim_time`.
    tick
        Called at each tick.

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
        self._due = 0  # ns of simulated time, when the next tick is due
        self._time = 0  # ns, of the last message on /clock
        # ns by the steady clock, of that message and of the last one with another time.
        self._message_at = self._moved_at = 0
        self._intervals: deque[float] = deque(maxlen=_RECENT)

    def start(self, rate: float) -> bool:
        """Start, or restart if the rate, Hz, or the clock has changed; return if the clock has."""
        # Compared with True: rclpy follows no /clock if the value is a number or a string.
        simulated = self._node.get_parameter('use_sim_time').value is True
        clock = self._node.get_clock() if simulated else self.steady
        changed = clock is not self._clock
        if not changed and rate == self._rate:
            return False
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None
        now = clock.now().nanoseconds
        if changed:
            self._clock = clock
            # The time on /clock before the first message may be long past.
            self._last = 0 if simulated else now
            self._last_steady = self.steady.now().nanoseconds
            self._intervals.clear()
        self._rate = rate
        if simulated:
            self._due = 0 if changed else now + self._period
        else:
            self._timer = self._node.create_timer(1 / rate, self._call, clock=clock)
        return changed

    def clock_moved(self) -> None:
        """Call for a tick if one is due; to be called after each message on /clock."""
        if not self.simulated or self._clock is None:
            return
        now, self._message_at = self._clock.now().nanoseconds, self.steady.now().nanoseconds
        if now != self._time:
            self._time, self._moved_at = now, self._message_at
        if now < self._last:  # set back: the next tick is due after a period
            self._due = min(self._due, now + self._period)
        if now >= self._due:
            # By whole periods: a late message does not shift later ticks.
            self._due += self._period * (1 + (now - self._due) // self._period)
            self._call()

    def tick(self) -> Tick:
        """Return the times of the present tick; to be called once in each."""
        assert self._clock is not None
        now, steady = self._clock.now().nanoseconds, self.steady.now().nanoseconds
        last, self._last = self._last, now
        wall, self._last_steady = 1e-9 * (steady - self._last_steady), steady
        elapsed, jump = 1e-9 * (now - last), None
        # Compared in nanoseconds: in seconds, three periods may be rounded to more than that.
        longest = round(1e9 * max(_JUMP, _JUMP_PERIODS / self._rate))
        if self.simulated and (last == 0 or not 0 <= now - last <= longest):
            elapsed, jump = 0.0, elapsed
        elif elapsed > 0:
            self._intervals.append(elapsed)
        return Tick(1e-9 * now, elapsed, wall, jump)

    @property
    def now(self) -> float:
        """Time of the clock that ticks follow, s."""
        assert self._clock is not None
        return 1e-9 * self._clock.now().nanoseconds

    @property
    def _period(self) -> int:
        # Rounded down: with a /clock of the same rate, in whole nanoseconds, each message is due.
        return int(1e9 / self._rate)

    @property
    def simulated(self) -> bool:
        """True if ticks follow /clock."""
        return self._clock is not self.steady

    @property
    def period(self) -> float:
        """Usual time between two ticks, s: that of the rate, or of a slower /clock."""
        period = 1 / self._rate
        return max(period, min(self._intervals, default=period)) if self.simulated else period

    @property
    def overdue(self) -> float:
        """Wall-clock time since the last tick, in periods of the rate."""
        return 1e-9 * (self.steady.now().nanoseconds - self._last_steady) * self._rate

    @property
    def why_overdue(self) -> str:
        """Why there is no tick, in words."""
        if not self.simulated:
            return 'the machine is busy'
        topic = self._node.resolve_topic_name(CLOCK_TOPIC)
        recently = self.steady.now().nanoseconds - _SILENCE
        if self._moved_at > recently:
            return f'the time on {topic} passes too slowly'
        if self._message_at > recently:
            return f'the time on {topic} stands still at {1e-9 * self._time:.9g} s; is it paused?'
        if self._node.count_publishers(topic) > 0:
            return f'{topic} has a publisher, but no valid message comes; is it paused?'
        return f'nothing publishes {topic}; start what does, or set use_sim_time to false'
