"""The clock of the ticks, and what is reported of them; time is set by the tests."""

from types import SimpleNamespace

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from hypothesis import given
from hypothesis import strategies as st
from rclpy.clock_type import ClockType
from rclpy.parameter import Parameter
from rclpy.time import Time
from ros import Probe, free_domain, probing
from rosgraph_msgs.msg import Clock as ClockMessage

from cloth_ros.live.report import Report
from cloth_ros.model.energy_monitor import RollbackCounts
from cloth_ros.node.status import evaluate
from cloth_ros.node.tick_clock import Tick, TickClock
from cloth_ros.node.tick_statistics import TickStatistics

RATE = 50.0  # Hz


class SetSteady:
    """A steady clock whose time is set by the test."""

    def __init__(self, nanoseconds: int) -> None:
        self.nanoseconds = nanoseconds

    def now(self) -> Time:
        return Time(nanoseconds=self.nanoseconds, clock_type=ClockType.STEADY_TIME)


class SetClock:
    """A clock of the ticks whose simulated time is set by the test, s."""

    def __init__(self, probe: Probe) -> None:
        probe.set_parameters([Parameter('use_sim_time', value=True)])
        self._clock = probe.get_clock()
        self._clock.set_ros_time_override(Time(clock_type=ClockType.ROS_TIME))
        self.ticks: list[Tick] = []
        self.clock = TickClock(probe, lambda: self.ticks.append(self.clock.tick()))
        assert self.clock.start(RATE)
        assert not self.clock.start(RATE)

    def set(self, seconds: float) -> list[Tick]:
        """Set the time; return the ticks at that time."""
        before = len(self.ticks)
        time = Time(nanoseconds=round(1e9 * seconds), clock_type=ClockType.ROS_TIME)
        self._clock.set_ros_time_override(time)
        self.clock.clock_moved()
        return self.ticks[before:]


@pytest.fixture(scope='module')
def probe():
    with free_domain() as domain, probing(domain) as probe:
        yield probe


@pytest.fixture
def clock(probe):
    return SetClock(probe)


@pytest.mark.parametrize('step', [0.02, 0.1, 0.2, 0.5, 1.0])
def test_a_clock_that_moves_rarely_is_followed_at_its_own_period(clock, step):
    clock.set(1000.0)
    for n in range(1, 20):
        (tick,) = clock.set(1000 + n * step)
        assert tick.jump is None
        assert tick.elapsed == pytest.approx(step)
        assert clock.set(1000 + n * step) == []  # no time has passed
        if n > 5:
            assert clock.clock.period == pytest.approx(step)


@given(st.lists(st.floats(-0.5, 0.9), max_size=30))
def test_a_tick_comes_at_the_first_message_after_each_period(probe, steps):
    clock, now = SetClock(probe), 1000.0
    clock.set(now)
    for step in steps:
        now += step
        ticks = clock.set(now)
        assert len(ticks) <= 1
        assert len(ticks) == 1 or step < 1 / RATE + 1e-8
        assert not ticks or ticks[0].elapsed > 0 or ticks[0].jump < 0
    time = sum(tick.elapsed + (tick.jump or 0.0) for tick in clock.ticks)
    assert time == pytest.approx(clock.ticks[-1].now, abs=1e-6)


@given(rate=st.floats(1.0, 3.0), periods=st.integers(1, 3), late=st.integers(0, 10**9))
def test_a_step_of_up_to_three_periods_is_followed_to_the_nanosecond(probe, rate, periods, late):
    """In seconds, 3 periods of 0.4 s are 1.2000000000000002 s, which is more than 3 / 2.5 Hz."""
    clock = SetClock(probe)
    clock.clock.start(rate)
    clock.set(1000.0 + 1e-9 * late)
    clock.ticks.clear()
    step = periods / rate
    for n in range(1, 5):
        clock.set(1000.0 + 1e-9 * late + n * round(step, 9))
    assert [tick.jump for tick in clock.ticks] == [None] * 4


def test_steps_that_are_no_time_of_the_cloth_are_jumps(clock):
    for seconds in (1000.0, 1000.02, 1002.0, 1002.02, 5.0, 5.02, 5.04):
        clock.set(seconds)
    elapsed = [tick.elapsed for tick in clock.ticks]
    assert elapsed == pytest.approx([0, 0.02, 0, 0.02, 0, 0.02])
    jumps = [tick.jump for tick in clock.ticks]
    assert [jump and round(jump, 2) for jump in jumps] == [1000.0, None, 1.98, None, -997.0, None]


def test_the_reason_for_no_tick_is_what_clock_does(clock, probe):
    """Without publisher; with one, without messages; and with messages of one or similar times."""
    steady = clock.clock.steady = SetSteady(clock.clock.steady.now().nanoseconds)
    assert 'nothing publishes /clock; start what does' in clock.clock.why_overdue
    publisher = probe.create_publisher(ClockMessage, '/clock', 1)
    probe.spin_until(lambda: probe.count_publishers('/clock'))
    assert 'no valid message comes' in clock.clock.why_overdue
    for n in range(5):
        steady.nanoseconds += 600_000_000
        clock.set(1000.0)
        assert ('stands still at 1000 s' in clock.clock.why_overdue) == (n >= 2)
    clock.set(1000.0 + 1e-3)
    assert '/clock passes too slowly' in clock.clock.why_overdue
    steady.nanoseconds += 2 * 10**9
    assert 'no valid message comes' in clock.clock.why_overdue
    probe.destroy_publisher(publisher)


def test_a_clock_that_is_selected_while_running_continues_from_its_first_message(clock, probe):
    """What has passed on it meanwhile was simulated by the wall clock."""
    clock.set(1000.0)
    for now in (1000.5, 5.0):
        probe.set_parameters([Parameter('use_sim_time', value=False)])
        assert clock.clock.start(RATE)
        assert clock.clock.why_overdue == 'the machine is busy'
        assert clock.set(now - 0.1) == []
        probe.set_parameters([Parameter('use_sim_time', value=True)])
        assert clock.clock.start(RATE)
        (tick,) = clock.set(now)
        assert (tick.elapsed, tick.jump) == (0.0, pytest.approx(now))
        assert clock.set(now) == []
        (tick,) = clock.set(now + 0.02)
        assert (tick.elapsed, tick.jump) == (pytest.approx(0.02), None)


def test_statistics_of_ticks_are_of_the_newest_since_the_last_report():
    statistics = TickStatistics()
    for n in range(100_000):
        statistics.begin(tick := Tick(0.01 * n, 0.01 + 0.001 * (n % 2), 0.01, None))
        statistics.end(tick, 1e-4)
    assert len(statistics) <= 10_000  # nobody may ever ask for them
    assert (statistics.ticks, statistics.jumps) == (100_000, 0)
    report = statistics.take_report(0.01)
    assert report['tick jitter, 99th percentile [s]'] == pytest.approx(0.001)
    assert report['messages, 99th percentile [s]'] == pytest.approx(1e-4)
    statistics.begin(jump := Tick(0.0, 0.0, 0.01, 5.0))
    statistics.end(jump, 1e-4)
    assert (statistics.ticks, statistics.jumps, statistics.jump) == (1, 1, 5.0)
    assert statistics.take_report(0.01) == {}


def status(*, ticks=60, jumps=0, overdue=0.5, paused=False, factor=1.0, **report):
    """Evaluate a report of the cloth, ticks since the last report, and periods without a tick."""
    values = {'lost': 0.0, 'cause': '', 'waiting': 0.0, 'held': '', 'reduction': ''}
    values |= {'rollbacks': RollbackCounts()} | report
    statistics = SimpleNamespace(ticks=ticks, jumps=jumps, jump=2.0)
    clock = SimpleNamespace(overdue=overdue, why_overdue='/clock stands still')
    return evaluate(Report(factor, **values), statistics, clock, paused=paused)


@pytest.mark.parametrize(
    ('values', 'text', 'well', 'factor'),
    [
        ({}, 'running in real time', True, 1.0),
        ({'paused': True, 'lost': 1.0}, 'paused', True, 0.0),
        # Ticks as slow as reports: one may fall before or after a report.
        ({'ticks': 0, 'overdue': 1.9}, 'running in real time', True, 1.0),
        ({'ticks': 0, 'overdue': 0.9, 'factor': 0.0}, 'no tick was due yet', True, 0.0),
        ({'ticks': 0, 'overdue': 3.0}, 'no tick since the last report: /clock s', False, 0.0),
        ({'ticks': 3, 'jumps': 3}, '/clock moves by 2 s at once', False, 0.0),
        ({'ticks': 3, 'jumps': 1}, 'running in real time', True, 1.0),
        (
            {'lost': 0.2, 'cause': 'too stiff', 'factor': 0.8},
            'slow motion, 0.2 s lost since the last report: too stiff',
            False,
            0.8,
        ),
        ({'reduction': 'grid 2 times coarser'}, 'overload: grid 2 times coarser', False, 1.0),
        ({'held': 'kernels are missing'}, 'held: kernels are missing', False, 1.0),
        ({'rollbacks': RollbackCounts(refined=3)}, 'unexplained energy', False, 1.0),
    ],
)
def test_the_status_is_what_needs_attention_most(values, text, well, factor):
    found = status(**values)
    assert text in found.message
    assert found.level == (DiagnosticStatus.OK if well else DiagnosticStatus.WARN)
    assert found.real_time_factor == factor
    assert not (well and found.logged)
