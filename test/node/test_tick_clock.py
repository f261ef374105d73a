"""The clock of the ticks, and what is reported of them; time is set by the tests."""

from types import SimpleNamespace

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.clock_type import ClockType
from rclpy.parameter import Parameter
from rclpy.time import Time
from ros import free_domain, probing

from cloth_ros.live.live_cloth import Report
from cloth_ros.model.energy_monitor import RollbackCounts
from cloth_ros.node.status import evaluate
from cloth_ros.node.tick_clock import Tick, TickClock
from cloth_ros.node.tick_statistics import TickStatistics

RATE = 50.0  # Hz


@pytest.fixture
def tick_at():
    """Set simulated time, s, and return the tick at that time and the period."""
    with free_domain() as domain, probing(domain) as probe:
        probe.set_parameters([Parameter('use_sim_time', value=True)])
        clock = TickClock(probe, lambda: None)
        assert clock.start(RATE)
        assert not clock.start(RATE)

        def tick(seconds: float) -> tuple[Tick, float]:
            time = Time(seconds=seconds, clock_type=ClockType.ROS_TIME)
            probe.get_clock().set_ros_time_override(time)
            return clock.tick(), clock.period

        yield tick


@pytest.mark.parametrize('step', [0.02, 0.1, 0.2, 0.5, 1.0])
def test_a_clock_that_moves_rarely_is_followed_at_its_own_period(tick_at, step):
    tick_at(1000.0)
    for n in range(1, 20):
        for _ in range(2):  # at one time of /clock, a timer may be due twice
            tick, period = tick_at(1000 + n * step)
            assert tick.jump is None
        if n > 5:
            assert period == pytest.approx(step)
        assert tick.elapsed == 0.0


def test_steps_that_are_no_time_of_the_cloth_are_jumps(tick_at):
    ticks = [tick_at(seconds)[0] for seconds in (1000.0, 1000.02, 1002.0, 1002.02, 5.0, 5.02)]
    assert [tick.elapsed for tick in ticks] == pytest.approx([0, 0.02, 0, 0.02, 0, 0.02])
    jumps = [tick.jump for tick in ticks]
    assert [jump and round(jump, 2) for jump in jumps] == [1000.0, None, 1.98, None, -997.02, None]


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


def status(*, ticks=60, jumps=0, overdue=0.5, simulated=False, paused=False, factor=1.0, **report):
    """Evaluate a report of the cloth, ticks since the last report, and periods without a tick."""
    values = {'lost': 0.0, 'rollbacks': RollbackCounts(), 'held': '', 'reduction': ''} | report
    statistics = SimpleNamespace(ticks=ticks, jumps=jumps, jump=2.0)
    clock = SimpleNamespace(overdue=overdue, simulated=simulated)
    return evaluate(Report(factor, **values), statistics, clock, paused=paused)


@pytest.mark.parametrize(
    ('values', 'text', 'well', 'factor'),
    [
        ({}, 'running in real time', True, 1.0),
        ({'paused': True, 'lost': 1.0}, 'paused', True, 0.0),
        # Ticks as slow as reports: one may fall before or after a report.
        ({'ticks': 0, 'overdue': 1.9}, 'running in real time', True, 1.0),
        ({'ticks': 0, 'overdue': 0.9, 'factor': 0.0}, 'no tick was due yet', True, 0.0),
        ({'ticks': 0, 'overdue': 3.0}, 'the machine is busy', False, 0.0),
        ({'ticks': 0, 'overdue': 3.0, 'simulated': True}, 'is /clock published', False, 0.0),
        ({'ticks': 3, 'jumps': 3, 'simulated': True}, '/clock moves by 2 s at once', False, 0.0),
        ({'ticks': 3, 'jumps': 1, 'simulated': True}, 'running in real time', True, 1.0),
        ({'lost': 0.2, 'factor': 0.8}, 'slow motion, 0.2 s lost', False, 0.8),
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
