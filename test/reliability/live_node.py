"""A running node and its listener, as the tests of faults and long runs need them."""

from __future__ import annotations

import signal
import time
from bisect import bisect_left
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from ros import NODE, PATIENCE, Listener, Process, environment, free_domain, probing
from std_srvs.srv import SetBool

# Messages in a row that show the full rate, and the time that they may take, as a share of the
# nominal one: messages that have waited come all at once.
_STEADY = 30
_LEAST, _MOST = 0.8, 1.1
SOON = 30.0  # s, within which a timed node must recover
REAL_TIME = 0.95  # least real-time factor of a report that counts as real time


class Interval:
    """
    What a node has published and used in an interval of time.

    `count` pauses between messages of particles, `late` of them longer than 1.5 periods, `longest`
    in s; messages that are `missing` by the rate, or were published and `lost`; the lowest
    real-time `factor` of whole seconds, 0 if there is none; `text` has all of it in words.
    """

    def __init__(self, node: LiveNode) -> None:
        self._node, self.began = node, time.monotonic()
        self._memory, self._used = node.process.memory, node.process.cpu_seconds

    def end(self, *, by_arrival: bool = False) -> None:
        """Evaluate; by the times of arrival where the system clock of the node is changed."""
        node, ended = self._node, time.monotonic()
        received = [each for each in node.listener.particles if each.at >= self.began]
        pauses = np.diff([each.at if by_arrival else each.sent for each in received])
        self.count, self.late = len(pauses), int((pauses > 1.5 / node.rate).sum())
        self.missing = max(int((ended - self.began) * node.rate) - len(received), 0)
        self.longest = float(pauses.max(initial=0.0))
        numbers = [each.number for each in received]
        self.lost = numbers[-1] - numbers[0] + 1 - len(numbers) if numbers else 0
        # The first report may describe the time before.
        reports = [each for each in node.listener.reports if each.at > self.began][1:]
        self.factor = min((each.factor for each in reports), default=0.0)
        used = 100 * (node.process.cpu_seconds - self._used) / (ended - self.began)
        self.text = (
            f'{self.late} of {self.count} ticks late, {self.missing} missing, longest pause '
            f'{self.longest:.3f} s, {self.lost} messages lost; lowest real-time factor '
            f'{self.factor:.3f}; {used:.0f} % of a core; '
            f'memory {node.process.memory - self._memory:+.1f} MB'
        )

    def require(self, *, real_time: bool = False) -> None:
        """Require of a timed node that no message was lost, and perhaps that it kept real time."""
        if self._node.timed:
            assert self.count > 0
            assert self.lost == 0
            assert self.factor >= REAL_TIME or not real_time


class LiveNode:
    """
    A node that publishes, its process, and a listener in this one.

    Rates are required of `timed` nodes only: they depend on the machine and its other work.
    """

    rate = 60.0  # Hz, of the ticks

    def __init__(self, domain: int, process: Process, listener: Listener, *, timed: bool) -> None:
        self._domain = domain
        self.process, self.listener, self.timed = process, listener, timed

    @contextmanager
    def beside(self, *command: str, until: str) -> Iterator[Process]:
        """Run another process in the domain, and wait until it has printed a text."""
        process = Process(command, environment(self._domain))
        try:
            process.wait_for_output(until)
            yield process
        finally:
            process.stop(signal.SIGKILL)

    @contextmanager
    def interval(self, *, by_arrival: bool = False) -> Iterator[Interval]:
        """Measure what is published and used meanwhile."""
        interval = Interval(self)
        yield interval
        interval.end(by_arrival=by_arrival)

    def recover(self) -> str:
        """
        Wait until the node publishes particles again; return how long that took, in words.

        Timed nodes must have their full rate for half a second, and report that all is well.
        """
        after, listener = time.monotonic(), self.listener
        count = _STEADY if self.timed else 5

        def first() -> float | None:
            begin = bisect_left(listener.particles, after, key=lambda each: each.at)
            times = [each.at for each in listener.particles[begin:]]
            for start, end in zip(times, times[count:], strict=False):
                if not self.timed or _LEAST < (end - start) * self.rate / _STEADY < _MOST:
                    return start
            return None

        def well() -> bool:
            reports = listener.reports
            # The first report after the moment may describe the time before it.
            after_that = len(reports) > 1 and reports[-2].at > after
            return after_that and reports[-1].level == DiagnosticStatus.OK

        patience = SOON if self.timed else PATIENCE
        listener.spin_until(lambda: first() and (not self.timed or well()), patience)
        return f'full rate after {first() - after:.2f} s'

    def wait_for_stamp(self, seconds: float) -> None:
        """Wait for particles that are stamped with a time, s, or the minute around it."""
        received = self.listener.particles
        self.listener.spin_until(lambda: abs(received[-1].stamp - seconds) < 60)

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
                listener.next_report()
                node = LiveNode(domain, process, listener, timed=timed)
                node.recover()
                yield node
        finally:
            process.end()
