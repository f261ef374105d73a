"""
Faults around a running node.

What disturbs the node is over after some seconds; then it must run as before.  Rates are required
in the long form only: they depend on the machine and on what else it does.
"""

import os
import signal
import time
from collections import Counter, deque
from contextlib import ExitStack

import numpy as np
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.qos import qos_profile_parameters
from rclpy.serialization import deserialize_message
from reliability.live_node import live_node
from reliability.peers import DEPTH, LAST, PEER
from ros import NODE, parameter_request, set_parameters
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

# Live nodes beside faults take minutes, and are no news after each small change.
pytestmark = pytest.mark.slow

MAX_TICK = 0.1  # s, the default of solver.max_tick
# s, by which simulated time may differ from the time between two reports: each gives that of the
# last tick before it.
RESOLUTION = 0.1

SPHERE = ('-p', 'sphere.radius:=0.1', '-p', 'sphere.position:=[0.0, 0.0, -5.0]')
# Markers that are larger than the shared memory that Fast DDS has by default.
LARGE = ('-p', 'sheet.rows:=64', '-p', 'sheet.columns:=64')


@pytest.fixture(scope='module')
def node(long):
    with live_node(*SPHERE, timed=long) as node:
        yield node


def test_node_stopped_and_continued(node, long, measured):
    """SIGSTOP and SIGCONT: at most solver.max_tick is made up, nothing is lost but the stop."""
    first, pid = node.listener.next_report(), node.process.process.pid
    with node.interval() as interval:
        os.kill(pid, signal.SIGSTOP)
        node.listener.spin_for(10.0 if long else 1.0)
        os.kill(pid, signal.SIGCONT)
        stopped = time.monotonic() - interval.began
        recovered = node.recover()
    last = node.listener.next_report()
    made_up = last.simulated - first.simulated - (last.at - first.at - stopped)
    measured(f'{interval.text}; {recovered}; {made_up:+.2f} s made up')
    node.check()
    assert made_up < MAX_TICK + RESOLUTION
    assert not long or made_up > -RESOLUTION


def test_commands_at_2000_hz(node, long, measured):
    """Wind and sphere at 2000 Hz each: real time is kept, the last command of each holds."""
    listener, newest = node.listener, deque(maxlen=1)
    markers = listener.create_subscription(
        MarkerArray, '/cloth/markers', lambda message: newest.append(message), 1, raw=True
    )
    seconds = '10' if long else '1'
    with (
        node.beside(*PEER, 'flood', '2000', seconds, until='begin') as peer,
        node.interval() as interval,
    ):
        listener.spin_until(lambda: not peer.alive)

    def last_commands_hold() -> bool:
        listener.spin_for(0.2)  # to read thousands of points takes long
        markers = {each.ns: each for each in deserialize_message(newest[0], MarkerArray).markers}
        calm = markers['wind'].action == Marker.DELETE
        return calm and markers['sphere'].pose.position.z == LAST

    listener.spin_until(lambda: newest)
    listener.spin_until(last_commands_hold)
    listener.destroy_subscription(markers)
    measured(f'{peer.output.splitlines()[-1]}; {interval.text}')
    node.check()
    interval.require(real_time=True)


def test_parameters_at_100_hz(node, long, measured):
    """Parameters changed 100 times a second, with resets and pauses: every request is answered."""
    listener = node.listener
    # As deep a queue as that of the service, for responses that are not read in time.
    change = listener.create_client(
        SetParameters, '/cloth/set_parameters', qos_profile=qos_profile_parameters
    )
    pause = listener.client(SetBool, '/cloth/pause')
    reset = listener.client(Trigger, '/cloth/reset')
    listener.spin_until(change.service_is_ready)

    def request(n: int):
        if n % 20 == 10:
            return reset.call_async(Trigger.Request())
        if n % 20 in (0, 5):
            return pause.call_async(SetBool.Request(data=n % 20 == 0))
        changes = (
            {'springs.bending': 50.0 + n % 7},
            {'wind.air_density': 1.2 * (n % 2)},  # with and without air: other kernels
            {'drag': 0.5 + 0.1 * (n % 5)},
        )
        return change.call_async(parameter_request(changes[n % 3]))

    answers = []
    with node.interval() as interval:
        for n in range(1000 if long else 100):
            listener.spin_for(max(interval.began + n / 100 - time.monotonic(), 0.0))
            answers.append(request(n))
    listener.spin_until(lambda: all(answer.done() for answer in answers))
    listener.destroy_client(change)
    set_parameters(listener, wind__air_density=1.2, drag=0.5, springs__bending=50.0)
    node.check()  # which ends a pause
    measured(f'{len(answers)} requests; {interval.text}; {node.recover()}')


def test_busy_processors(node, long, measured):
    """As many busy processes as cores: no message is lost; full rate and real time afterwards."""
    with ExitStack() as stack:
        for _ in range(os.cpu_count() or 1):
            stack.enter_context(node.beside(*PEER, 'burn', until='begin'))
        with node.interval() as interval:
            node.listener.spin_for(10.0 if long else 1.0)
    measured(f'{interval.text}; {node.recover()}')
    node.check()
    interval.require()


def test_second_node_of_the_same_name(node, measured):
    """Another node called /cloth, which ends again: both live and warn of it."""
    with node.beside(*NODE, until='another node called /cloth') as other:
        node.process.wait_for_output('another node called /cloth')
        node.check()
        assert other.stop() == 0, other.output
    measured(node.recover())
    node.check()


class SimulatedClock:
    """Publishes /clock at 200 Hz, in equal steps: it stops where this process does."""

    def __init__(self, listener) -> None:
        self.now, self.stopped = 5000.0, False
        self._publisher = listener.publisher(Clock, '/clock')
        self.timer = listener.create_timer(1 / 200, self._publish)

    def _publish(self) -> None:
        if not self.stopped:
            self.now += 1 / 200
            message = Clock()
            message.clock.sec, message.clock.nanosec = divmod(int(1e9 * self.now), 10**9)
            self._publisher.publish(message)


@pytest.fixture
def clock(node):
    set_parameters(node.listener, use_sim_time=True)
    clock = SimulatedClock(node.listener)
    node.recover()
    yield clock
    node.listener.destroy_timer(clock.timer)
    set_parameters(node.listener, use_sim_time=False)
    node.recover()


def test_simulated_clock_jumps(node, clock, measured):
    """/clock jumps by +1000 s and -2000 s: simulated time goes on as if without, to 0.5 s."""
    slow, differences = node.process.output.count('slow motion'), []
    for jump in (1000.0, -2000.0):
        before, shown = node.listener.next_report().simulated, clock.now
        clock.now += jump
        node.wait_for_stamp(clock.now)
        node.recover()
        simulated = node.listener.next_report().simulated - before
        differences.append(simulated - (clock.now - jump - shown))
    measured(f'{" and ".join(f"{each:+.2f} s" for each in differences)} simulated at the jumps')
    node.check()
    assert max(map(abs, differences)) < 0.5
    assert node.process.output.count('slow motion') == slow


def test_simulated_clock_stops(node, clock, long, measured):
    """/clock stops: so does the cloth, the diagnostics say why; it goes on with /clock."""
    clock.stopped = True
    silent = '/clock has a publisher, but no valid message comes'
    node.listener.spin_until(lambda: silent in node.listener.next_report().message)
    received = len(node.listener.particles)
    node.listener.spin_for(10.0 if long else 0.5)
    assert len(node.listener.particles) == received
    clock.stopped = False
    measured(node.recover())
    node.check()


# Subscribers


@pytest.fixture(scope='module')
def large_node(long):
    with live_node(*LARGE, timed=long) as node:
        node.marker_times = []
        receive = lambda _: node.marker_times.append(time.monotonic())  # noqa: E731
        node.listener.create_subscription(MarkerArray, '/cloth/markers', receive, DEPTH, raw=True)
        node.listener.spin_until(lambda: node.marker_times)
        yield node


def longest_marker_pause(node, since: float) -> float:
    """Return the longest time without markers, s."""
    times = [each for each in node.marker_times if each >= since]
    return float(np.diff([since, *times, time.monotonic()]).max())


@pytest.mark.parametrize('fault', [signal.SIGSTOP, signal.SIGKILL], ids=['hangs', 'is killed'])
def test_a_reliable_subscriber(large_node, fault, long, measured):
    """
    Ten times: others lose nothing, at most 2 % of ticks are late, markers pause for 0.1 s at most.

    Twice in ten the machine may be too busy for that, but for less than Fast DDS waits for a lock.
    """
    node, held_up, longest, counts = large_node, 0, 0.0, Counter()
    for _ in range(10 if long else 1):
        with node.beside(*PEER, 'subscribe', until='begin') as peer:
            node.recover()
            with node.interval() as interval:
                peer.process.send_signal(fault)
                node.listener.spin_for(2.5 if long else 0.5)
                node.recover()
            pause = longest_marker_pause(node, interval.began)
        late = interval.late + interval.missing > 0.02 * interval.count
        held_up += late or pause >= 0.1
        longest = max(longest, pause, interval.longest)
        counts.update(ticks=interval.count, late=interval.late, lost=interval.lost)
    measured(f'{dict(counts)}, longest pause {longest:.3f} s; held up {held_up} times')
    node.check()
    assert not long or (held_up <= 2 and longest < 1.0 and counts['lost'] == 0)


def test_subscribers_that_come_and_go(large_node, long, measured):
    """100 subscribers, the last ten of them killed: each receives, others lose nothing."""
    node, count = large_node, '100 10' if long else '4 2'
    with (
        node.beside(*PEER, 'crowd', *count.split(), until='begin') as peer,
        node.interval() as interval,
    ):
        node.listener.spin_until(lambda: not peer.alive)
        pause = longest_marker_pause(node, interval.began)
    assert 'all have received' in peer.output
    # Before it first writes to a participant, Fast DDS checks whether it is alive, which may hold
    # up the publisher for a third of the participant's healthy_check_timeout_ms, 1 s.
    measured(f'{interval.text}; longest pause of the markers {pause:.3f} s; {node.recover()}')
    node.check()
    interval.require()
