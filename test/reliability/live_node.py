"""A running node and its listener, as the tests of faults and long runs need them."""

from __future__ import annotations

import signal
import time
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from ros import NODE, PATIENCE, Listener, Process, ReceivedCloud, environment, free_domain, probing
from std_srvs.srv import SetBool

# Messages in a row that show the full rate, and the time that they may take, as a share of the
# nominal one: messages that have waited come all at once.
_STEADY = 30
_LEAST, _MOST = 0.8, 1.1
SOON = 30.0  # s, within which a timed node must recover


class Ticks(NamedTuple):
    """
    Regularity of the messages of particles in an interval of time.

    Attributes
    ----------
    count, late
        Pauses between two messages, and those of them that exceed a period by half of it.
    missing
        Messages fewer than the rate requires.
    longest
        Longest pause, s.
    lost
        Messages that were published but not received.

    """

    count: int
    late: int
    missing: int
    longest: float
    lost: int

    @classmethod
    def measure(
        cls,
        received: Sequence[ReceivedCloud],
        rate: float,
        since: float,
        until: float,
        *,
        by_arrival: bool = False,
    ) -> Ticks:
        """
        Evaluate the messages received between two times, s, of a node that ticks at a rate, Hz.

        Pauses are measured between publications, or receptions where the system clock of the node
        is changed.
        """
        window = [each for each in received if since <= each.at <= until]
        due = int((until - since) * rate)
        if len(window) < 2:
            return cls(0, 0, due, until - since, 0)
        pauses = np.diff([each.at if by_arrival else each.sent for each in window])
        late = int((pauses > 1.5 / rate).sum())
        missing = max(due - len(window), 0)
        lost = window[-1].number - window[0].number + 1 - len(window)
        return cls(len(pauses), late, missing, float(pauses.max()), lost)

    @property
    def text(self) -> str:
        """All values, in words."""
        return (
            f'{self.late} of {self.count} ticks late, {self.missing} missing, longest pause '
            f'{self.longest:.3f} s, {self.lost} messages lost'
        )


class LiveNode:
    """
    A node that publishes, and a listener.

    Attributes
    ----------
    process, listener
        The node's process; the probe in this one.
    timed
        True to require rates, which depend on the machine and on what else it does.

    """

    rate = 60.0  # Hz, of the ticks

    def __init__(self, domain: int, process: Process, listener: Listener, *, timed: bool) -> None:
        self._domain = domain
        self.process = process
        self.listener = listener
        self.timed = timed

    @contextmanager
    def beside(self, *command: str, until: str) -> Iterator[Process]:
        """Run another process in the domain, and wait until it has printed a text."""
        process = Process(command, environment(self._domain))
        try:
            process.wait_for_output(until)
            yield process
        finally:
            process.stop(signal.SIGKILL)

    def recover(self, after: float) -> float:
        """
        Wait until the node publishes particles again.

        Timed nodes must have their full rate for half a second, and report that all is well.
        Returned is how long after a moment, s, the first of these messages came.
        """
        listener, nominal = self.listener, _STEADY / self.rate
        count = _STEADY if self.timed else 5

        def first() -> float | None:
            begin = bisect_left(listener.particles, after, key=lambda each: each.at)
            times = [each.at for each in listener.particles[begin:]]
            for start, end in zip(times, times[count:], strict=False):
                if not self.timed or _LEAST < (end - start) / nominal < _MOST:
                    return start
            return None

        def well() -> bool:
            reports = listener.reports
            # The first report after the moment may describe the time before it.
            after_that = len(reports) > 1 and reports[-2].at > after
            return after_that and reports[-1].level == DiagnosticStatus.OK

        patience = SOON if self.timed else PATIENCE
        listener.spin_until(lambda: first() and (not self.timed or well()), patience)
        return (first() or after) - after

    def wait_for_stamp(self, seconds: float) -> None:
        """Wait for particles that are stamped with a time, s, or the minute around it."""
        received = self.listener.particles
        self.listener.spin_until(lambda: abs(received[-1].stamp - seconds) < 60)

    def ticks(self, since: float, until: float, *, by_arrival: bool = False) -> Ticks:
        """Return the regularity of the messages between two times, s."""
        received = self.listener.particles
        return Ticks.measure(received, self.rate, since, until, by_arrival=by_arrival)

    def lowest_factor(self, since: float, until: float) -> float:
        """Return the lowest real-time factor of whole seconds between two times; 0: none."""
        reports = [each for each in self.listener.reports if since < each.at <= until]
        return min((each.factor for each in reports[1:]), default=0.0)

    def check(self) -> None:
        """Check that the node lives, answers, and has published only finite numbers."""
        answer = self.listener.call(SetBool, '/cloth/pause', SetBool.Request(data=False))
        assert answer.success
        assert self.process.alive
        assert not self.listener.not_finite
        assert 'Traceback' not in self.process.output, self.process.output


@contextmanager
def live_node(
    *ros_arguments: str, timed: bool, variables: dict[str, str] | None = None
) -> Iterator[LiveNode]:
    """Start a node with ROS arguments and environment variables, and a listener."""
    with free_domain() as domain:
        command = (*NODE, '--ros-args', *ros_arguments)
        process = Process(command, {**environment(domain), **(variables or {})})
        try:
            # One after the other: Fast DDS may miss a participant that starts at the same moment.
            process.wait_for_output('publishing')
            with probing(domain, Listener) as listener:
                node = LiveNode(domain, process, listener, timed=timed)
                listener.next_report()
                node.recover(time.monotonic())
                yield node
        finally:
            process.end()
