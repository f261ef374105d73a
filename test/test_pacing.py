import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rosgraph_msgs.msg import Clock


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
