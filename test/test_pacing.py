import pytest
from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import given
from hypothesis import strategies as st
from rosgraph_msgs.msg import Clock

from cloth_ros.live.pacing import Pacing
from cloth_ros.node.tick_clock import Tick
from cloth_ros.node.tick_statistics import TickStatistics

TICK = 1 / 60
elapsed_times = st.lists(st.floats(-0.5, 0.5), min_size=1, max_size=200)


@given(elapsed_times, st.floats(1e-5, TICK), st.floats(1e-3, 10.0), st.floats(0, 1e-3))
def test_time_is_simulated_pending_or_lost_and_nothing_else(elapsed, substep, max_tick, cost):
    pacing, simulated = Pacing(), 0.0
    for seconds in elapsed:
        count = pacing.due(seconds, substep, TICK, max_tick, TICK)
        assert count >= 0
        if count:
            pacing.done(count, substep, count * cost)
            simulated += count * substep
        assert -0.5001 * substep <= pacing.pending <= max(max_tick, 1.5 * TICK) + 1e-9
    forwards = sum(max(seconds, 0.0) for seconds in elapsed)
    assert simulated + pacing.pending + pacing.lost == pytest.approx(forwards, abs=1e-4)


def test_jitter_does_not_add_up():
    pacing, total = Pacing(), 0
    substep = TICK / 44
    for n in range(6000):
        jitter = 0.003 if n % 2 else -0.003
        count = pacing.due(TICK + jitter, substep, TICK, 0.1, TICK)
        pacing.done(count, substep, 1e-4)
        total += count
    assert abs(total - 6000 * 44) <= 44
    factor, lost = pacing.take_report()
    assert factor == pytest.approx(1.0, abs=1e-3)
    assert lost == 0


def test_one_substep_a_tick_is_one_at_every_tick():
    pacing = Pacing()
    for n in range(1000):
        count = pacing.due(TICK + (2e-4 if n % 3 else -4e-4), TICK, TICK, 0.1, TICK)
        assert count == 1
        pacing.done(count, TICK, 1e-4)


def test_what_is_expected_bounds_the_first_tick():
    pacing = Pacing()
    pacing.expect(1e-3)
    assert pacing.due(0.1, 1e-6, TICK, 0.1, TICK) == 13


def test_an_overloaded_machine_keeps_the_ticks_and_loses_time():
    pacing, substep = Pacing(), TICK / 100
    cost = 2 * substep  # twice as slow as real time
    elapsed = TICK
    for _ in range(300):
        count = pacing.due(elapsed, substep, TICK, 0.1, TICK)
        wall = count * cost
        pacing.done(count, substep, wall)
        elapsed = max(wall, TICK)
    assert wall <= TICK
    factor, lost = pacing.take_report()
    assert 0.3 < factor < 0.5
    assert lost > 0
    assert pacing.load(substep) == pytest.approx(2, rel=0.01)


def test_one_tick_that_was_stopped_in_its_middle_makes_no_slow_motion():
    pacing, substep = Pacing(), TICK / 40
    for n in range(200):
        count = pacing.due(10.0 if n == 101 else TICK, substep, TICK, 0.1, TICK)
        pacing.done(count, substep, 10.0 if n == 100 else count * 0.2 * substep)
        if n == 101:
            assert pacing.take_report()[1] == pytest.approx(9.9, abs=0.1)
    assert pacing.take_report()[1] == 0
    assert pacing.pending < substep


def test_what_has_become_dear_is_noticed_within_three_ticks():
    pacing, substep = Pacing(), TICK / 40
    for _ in range(100):
        pacing.done(pacing.due(TICK, substep, TICK, 0.1, TICK), substep, 0.1 * TICK)
    for _ in range(3):
        count = pacing.due(TICK, substep, TICK, 0.1, TICK)
        pacing.done(count, substep, count * 50 * substep)
    assert pacing.due(TICK, substep, TICK, 0.1, TICK) <= 4


def test_a_stall_is_made_up_as_far_as_allowed():
    pacing, substep = Pacing(), TICK / 10
    pacing.done(1, substep, 1e-6)
    assert pacing.due(10.0, substep, TICK, 0.1, TICK) == 60
    assert pacing.lost == pytest.approx(9.9, abs=2 * substep)


@pytest.mark.parametrize('rate', [1.0, 2.0, 5.0, 10.0])
@given(
    lateness=st.lists(st.floats(-0.2, 0.2), min_size=1, max_size=50), max_tick=st.floats(1e-3, 0.1)
)
def test_ordinary_ticks_lose_no_time_however_long_they_are(rate, lateness, max_tick):
    pacing, tick, late = Pacing(), 1 / rate, 0.0
    for share in lateness:  # of a tick, that this one is late, or early
        elapsed = tick + (share - late) * tick
        late = share
        count = pacing.due(elapsed, tick / 20, tick, max_tick, tick)
        if count:
            pacing.done(count, tick / 20, 1e-4)
    assert pacing.lost == 0
    factor, _ = pacing.take_report()
    assert factor == pytest.approx(1.0, abs=0.05)


def test_a_report_without_a_tick_keeps_the_factor():
    pacing = Pacing()
    pacing.done(pacing.due(1.0, 0.1, 1.0, 0.1, 1.0), 0.1, 1e-4)
    assert pacing.take_report()[0] == pytest.approx(1.0)
    assert pacing.take_report()[0] == pytest.approx(1.0)


def test_times_of_ticks_that_no_one_reads_do_not_pile_up():
    times = TickStatistics()
    for _ in range(100_000):
        times.end(Tick(0.0, 1e-3, 1e-3, None), 1e-4)
    assert len(times) <= 10_000
    assert times.take_report(1e-3)['tick jitter, 99th percentile [s]'] == 0
    assert len(times) == 0


def well(status):
    factor = next(item.value for item in status.values if item.key == 'real-time factor')
    return status.message == 'running in real time' and abs(float(factor) - 1) < 0.1


@pytest.mark.parametrize('rate', [1, 5])
def test_a_slow_rate_is_no_slow_motion(start_cloth, probe, rate):
    start_cloth(rate=rate)
    reports = probe.collect(DiagnosticArray, '/diagnostics')
    probe.spin_until(lambda: len(reports) >= 4 and all(well(r.status[0]) for r in reports[-4:]))


def spin_under_clock(probe, step, condition):
    """Move /clock in steps, s, until four reports in a row fulfil a condition."""
    clock = probe.publisher(Clock, '/clock')
    reports = probe.collect(DiagnosticArray, '/diagnostics')
    for n in range(1000):
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(10**12 + n * round(step * 1e9), 10**9)
        clock.publish(message)
        probe.spin_for(0.05)
        if len(reports) >= 4 and all(condition(report.status[0]) for report in reports[-4:]):
            return
    raise AssertionError(reports[-1].status[0])


def test_a_clock_of_a_step_a_tick_is_followed_at_a_slow_rate(start_cloth, probe):
    """1.005 s was a jump once, and nothing moved."""
    start_cloth(use_sim_time='true', rate=1)
    spin_under_clock(probe, 1.005, well)


def test_a_clock_that_only_jumps_is_told_of(start_cloth, probe):
    def told(status):
        values = {item.key: item.value for item in status.values}
        return '/clock moves by' in status.message and float(values['real-time factor']) == 0

    start_cloth(use_sim_time='true')
    spin_under_clock(probe, 2.0, told)


@pytest.mark.parametrize('step', [0.1, 0.2, 0.5])
def test_a_clock_that_comes_rarely_is_followed_in_full(start_cloth, probe, step):
    """What was beyond solver.max_tick was called slow motion, on an idle machine."""
    start_cloth(use_sim_time='true')
    spin_under_clock(probe, step, well)
