"""Service ~/step, and a node that is the clock of a simulation."""

from collections.abc import Iterator

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from node.conftest import PERIOD, SteppedCloth, at_rest, running
from rclpy.parameter import Parameter
from ros import (
    FLOATING,
    NODE,
    Probe,
    Process,
    diagnosis,
    environment,
    free_domain,
    numbers,
    set_parameters,
    stamp,
    wind,
)
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

from cloth_ros import Cloth


def step(probe: Probe) -> Trigger.Response:
    return probe.call(Trigger, '/cloth/step', Trigger.Request())


def pause(probe: Probe, data: bool) -> None:
    assert probe.call(SetBool, '/cloth/pause', SetBool.Request(data=data)).success


# Steps


def test_a_step_simulates_one_tick_of_a_paused_cloth(cloth: SteppedCloth, tmp_path):
    """The states are those of the model, a period apart."""
    file = tmp_path / 'cloth.snapshot'
    assert cloth.set(snapshot__file=str(file)) == ['']
    cloth.send('/wind', wind(z=5.0))
    cloth.tick_until(lambda state: not at_rest(state))
    cloth.pause(True)
    cloth.tick()
    assert cloth.probe.call(Trigger, '/cloth/save', Trigger.Request()).success
    alone = Cloth.load(file)
    for _ in range(5):
        first, time = len(cloth.states), stamp(cloth.states[-1])
        assert step(cloth.probe).success
        cloth.probe.spin_until(lambda: len(cloth.states) > first)  # noqa: B023
        alone.advance(PERIOD)
        stepped = numbers(cloth.states[first])[..., :3]
        assert np.array_equal(stepped, alone.positions.astype(np.float32))
        assert stamp(cloth.states[first]) - time == pytest.approx(PERIOD, abs=1e-8)
    assert diagnosis(cloth.probe)['message'] == 'paused'


def test_stamps_never_go_back_when_the_cloth_continues_after_steps(cloth: SteppedCloth):
    cloth.pause(True)
    first = len(cloth.states)
    for _ in range(20):  # while /clock stands still
        assert step(cloth.probe).success
    cloth.pause(False)
    cloth.tick(40)
    times = [state.header.stamp for state in cloth.states[first:]]
    stamps = [time.sec * 10**9 + time.nanosec for time in times]  # some differ by 1 ns
    assert min(np.diff(stamps)) > 0
    assert abs(stamps[-1] - cloth.now) < 1e9 * PERIOD


def test_a_cloth_that_runs_is_not_stepped(cloth: SteppedCloth):
    cloth.tick()
    before = diagnosis(cloth.probe)['simulated time [s]']
    response = step(cloth.probe)
    assert not response.success
    assert 'ros2 service call /cloth/pause std_srvs/srv/SetBool' in response.message
    assert diagnosis(cloth.probe)['simulated time [s]'] == before


# /clock


class ClockedCloth:
    """A node that publishes /clock, and what a second node under use_sim_time sees."""

    def __init__(self, process: Process, probe: Probe) -> None:
        self.process, self.probe = process, probe
        self.states: list[PointCloud2] = probe.collect(PointCloud2, '/cloth/particles', 1000)
        probe.set_parameters([Parameter('use_sim_time', value=True)])
        probe.spin_until(lambda: self.now > 0)

    @property
    def now(self) -> float:
        """Time of the second node, s."""
        return 1e-9 * self.probe.get_clock().now().nanoseconds

    def wait_for_state(self) -> PointCloud2:
        count = len(self.states)
        self.probe.spin_until(lambda: len(self.states) > count)
        return self.states[-1]


@pytest.fixture(scope='module')
def clocked() -> Iterator[ClockedCloth]:
    with running(clock__publish='true', rate=1 / PERIOD, **FLOATING) as (process, probe):
        yield ClockedCloth(process, probe)


def test_the_time_advances_stops_and_steps(clocked: ClockedCloth):
    probe, before = clocked.probe, clocked.now
    probe.spin_until(lambda: clocked.now > before + 0.2)
    pause(probe, True)
    clocked.wait_for_state()
    still = stamp(clocked.wait_for_state())
    probe.spin_until(lambda: clocked.now == pytest.approx(still, abs=1e-9))
    for number in range(1, 4):
        assert step(probe).success
        probe.spin_until(lambda: clocked.now == pytest.approx(still + number * PERIOD, abs=1e-9))  # noqa: B023
    assert stamp(clocked.wait_for_state()) == pytest.approx(clocked.now, abs=1e-9)
    assert float(diagnosis(probe)['simulated time [s]']) == pytest.approx(clocked.now, abs=1e-9)
    pause(probe, False)
    probe.spin_until(lambda: clocked.now > still + 0.2)


def test_the_stamps_of_all_messages_are_simulated_time(clocked: ClockedCloth):
    reports = clocked.probe.collect(DiagnosticArray, '/diagnostics')
    markers = clocked.probe.collect(MarkerArray, '/cloth/markers')
    clocked.probe.spin_until(lambda: reports and markers)
    newest = (stamp(reports[-1]), stamp(markers[-1].markers[0]), stamp(clocked.states[-1]))
    assert max(abs(each - clocked.now) for each in newest) < 60.0  # not since 1970


def test_a_reset_returns_to_time_zero(clocked: ClockedCloth):
    before = clocked.now
    assert before > 0.2
    clocked.probe.call(Trigger, '/cloth/reset', Trigger.Request())
    clocked.probe.spin_until(lambda: clocked.now < before)


def test_a_lower_rate_leaves_out_messages(clocked: ClockedCloth):
    clocks: list[Clock] = clocked.probe.collect(Clock, '/clock')
    assert [each.reason for each in set_parameters(clocked.probe, clock__rate=5.0)] == ['']
    clocked.probe.spin_until(lambda: spacing(clocks) > 3 * PERIOD)
    set_parameters(clocked.probe, clock__rate=0.0)
    clocked.probe.spin_until(lambda: spacing(clocks) < 3 * PERIOD)


def spacing(clocks: list[Clock]) -> float:
    """Return the time between the newest messages, s."""
    times = [each.clock.sec + 1e-9 * each.clock.nanosec for each in clocks[-4:]]
    return float(np.median(np.diff(times))) if len(times) == 4 else 0.0


def test_it_does_not_follow_its_own_clock(clocked: ClockedCloth):
    (result,) = set_parameters(clocked.probe, use_sim_time=True)
    assert 'clock.publish:=false' in result.reason
    before = clocked.now
    clocked.probe.spin_until(lambda: clocked.now > before)
    arguments = ('-p', 'clock.publish:=true', '-p', 'use_sim_time:=true')
    with free_domain() as domain:
        process = Process((*NODE, '--ros-args', *arguments), environment(domain))
        assert process.stop(0) == 2
    assert 'write clock.publish: false' in process.output
    assert process.output.count('\n') == 1


def test_another_publisher_on_the_clock_is_warned_of(clocked: ClockedCloth):
    publisher = clocked.probe.create_publisher(Clock, '/clock', 1)
    clocked.process.wait_for_output('/clock is published by /probe too')
    clocked.probe.destroy_publisher(publisher)
