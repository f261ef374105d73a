"""A node that follows /clock."""

import itertools

import numpy as np
import pytest
from node.conftest import FREE_FALL, durations
from ros import diagnosis, numbers, stamp
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


def test_a_clock_that_stands_still_is_reported(cloth):
    published = len(cloth.states)
    cloth.probe.spin_until(lambda: 'is /clock published?' in diagnosis(cloth.probe)['message'])
    assert len(cloth.states) == published
