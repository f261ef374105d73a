"""A node that follows /clock."""

import itertools

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from node.conftest import FREE_FALL, PERIOD, durations
from ros import FLOATING, diagnosis, numbers, publish_until, stamp
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray


@pytest.fixture
def falling(cloth):
    """The stepped node with a sheet in free fall."""
    assert cloth.set_together(FREE_FALL) == ''
    cloth.tick_until(lambda state: state[..., 5].max() < 0)
    return cloth


@pytest.mark.parametrize(('rate', 'step'), [(50.0, 0.02), (10.0, 0.2), (10.0, 0.5), (1.0, 1.005)])
def test_a_clock_of_any_step_is_followed_in_full(falling, rate, step):
    assert falling.set(rate=rate) == ['']
    for _ in range(15):  # the first five, from which the node determines the step, are left out
        falling.tick(1, step)
        falling.probe.spin_for(0.02)  # a hundred times as long as the node needs
    messages = falling.states
    assert durations(messages[-6:]) == pytest.approx([step] * 5, rel=0.01)
    assert abs(stamp(messages[-1]) - 1e-9 * falling.now) < step + 1 / rate


def test_a_player_of_a_bag_drives_the_cloth(falling):
    """As `ros2 bag play --clock` does, 40 times a second: less often than the 60 ticks."""
    step, rate = 1 / 40, 60.0
    assert falling.set(rate=rate) == ['']
    for _ in range(45):
        falling.tick(1, step)
        falling.probe.spin_for(0.02)
    # Without springs a substep is as long as a tick: one or two of them in each state.
    passed = durations(falling.states[-41:])
    assert set(np.round(passed * rate)) <= {1.0, 2.0}
    assert abs(passed.sum() - 40 * step) < 1.01 / rate


def test_a_clock_that_jumps_moves_the_stamps_and_not_the_cloth(falling):
    markers: list[MarkerArray] = falling.probe.collect(MarkerArray, '/cloth/markers')
    for jump in (1e8, -0.5e8, -0.4e8):
        first = len(falling.states)
        falling.tick(5)
        falling.jump(jump)
        falling.tick(5)
        pairs = list(itertools.pairwise(falling.states[first:]))
        (jumped,) = (pair for pair in pairs if abs(stamp(pair[1]) - stamp(pair[0])) > 1)
        np.testing.assert_allclose(numbers(jumped[1]), numbers(jumped[0]), atol=0.01)
        pairs.remove(jumped)
        assert all(0 <= durations(pair)[0] < 1 for pair in pairs)
        markers.clear()
        falling.tick_until(lambda _: markers)
        assert abs(stamp(markers[-1].markers[0]) - 1e-9 * falling.now) < 1


def test_a_clock_that_only_jumps_is_reported(falling):
    def reported() -> bool:
        falling.tick(seconds=2.0)
        return '/clock moves by 2 s at once' in diagnosis(falling.probe)['message']

    (before,) = falling.tick()
    falling.probe.spin_until(reported)
    assert float(diagnosis(falling.probe)['real-time factor']) == 0
    np.testing.assert_allclose(falling.tick(seconds=2.0)[0], before, atol=0.01)


def test_a_clock_that_does_not_move_is_explained_and_causes_no_tick(start_cloth, probe):
    """No publisher, one without messages, and one whose time stands still, as when paused."""
    start_cloth(use_sim_time='true', rate=1 / PERIOD, **FLOATING)
    particles: list[PointCloud2] = probe.collect(PointCloud2, '/cloth/particles')
    reports: list[DiagnosticArray] = probe.collect(DiagnosticArray, '/diagnostics')

    def reported(text: str) -> bool:
        return bool(reports) and text in reports[-1].status[0].message

    probe.spin_until(lambda: reported('nothing publishes /clock; start what does'))
    clock = probe.publisher(Clock, '/clock')
    probe.spin_until(lambda: reported('/clock has a publisher, but no valid message comes'))
    still = itertools.repeat(Clock(clock=Time(sec=1000)))
    publish_until(lambda: reported('/clock stands still at 1000 s'), probe, clock, still)
    for request in (SetBool.Request(data=True), SetBool.Request(data=False)):
        probe.call(SetBool, '/cloth/pause', request)
        probe.call(Trigger, '/cloth/reset', Trigger.Request())
        reports.clear()
        publish_until(lambda: len(reports) > 1, probe, clock, still)
    assert [stamp(message) for message in particles] == [1000.0]


def test_no_state_is_published_twice_with_one_stamp(falling):
    """Two ticks less than half a substep apart, on both sides of the end of a period."""
    first = len(falling.states)
    for _ in range(5):
        falling.tick(1, 2 * PERIOD - 1e-4)
        for _ in range(3):  # subscriptions to /clock are best-effort
            falling.send_time(2e-4)
            falling.probe.spin_for(0.02)
        falling.tick(1, PERIOD + 1e-4)
    stamps = np.array([stamp(message) for message in falling.states[first:]])
    assert np.diff(stamps).min() > PERIOD / 2
