"""Gusts: periodic, of random speed, a function of seed and time."""

import numpy as np
import pytest
from builders import examples
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Gust
from cloth_ros.model.forces.gusts import Gusts


@pytest.mark.parametrize('period', [0.1, 0.3, 0.7, 5.0])
def test_a_gust_blows_from_every_period_on_for_its_duration(period):
    gusts = Gusts(Gust(period=period, duration=0.25 * period, speed=(1.0, 4.0)))
    edges, blows = [0.5 * period], []
    for _ in range(200):
        edges.append(gusts.next_change(edges[-1]))
        blows.append(gusts.velocity(0.5 * (edges[-2] + edges[-1])).any())
    expected = np.stack([np.arange(1, 101), np.arange(1, 101) + 0.25], 1).ravel() * period
    np.testing.assert_allclose(edges[1:], expected, rtol=1e-12)
    assert blows == [False, True] * 100
    # Also at the moment of an edge itself, which is rounded.
    assert [gusts.velocity(edge).any() for edge in edges[1:]] == [True, False] * 100


def test_speeds_are_uniform_and_a_function_of_seed_and_time():
    gust = Gust(period=5.0, duration=1.0, direction=(0, 2, 0), speed=(1.0, 4.0), seed=3)
    times = 5.0 * np.arange(1, 400) + 0.5
    gusts, backwards = Gusts(gust), Gusts(gust)
    velocities = np.array([gusts.velocity(time) for time in times])
    assert np.array_equal(velocities[::-1], [backwards.velocity(time) for time in times[::-1]])
    assert not velocities[:, [0, 2]].any()
    speeds = velocities[:, 1]
    expected = pytest.approx((1.0, 2.5, 4.0), abs=0.2)
    assert (speeds.min(), speeds.mean(), speeds.max()) == expected
    assert 1.0 <= speeds.min() < speeds.max() <= 4.0
    assert Gusts(Gust(period=5.0, speed=(1.0, 4.0), seed=4)).velocity(5.5)[1] != speeds[0]


@examples(0.5)
@given(
    # None of 0.1, 0.3, 1/3 is a floating point number, nor are their multiples exact.
    period=st.sampled_from([0.1, 0.3, 1 / 3, 0.7, 2.0]) | st.floats(1e-3, 1e3),
    share=st.sampled_from([0.0, 0.1, 0.3, 1.0]) | st.floats(0, 1),
    number=st.integers(0, 10_000),
    part=st.sampled_from([0.0, 0.1, 0.3, 1.0]) | st.floats(0, 1),
)
def test_the_air_velocity_is_constant_until_the_next_change(period, share, number, part):
    gusts = Gusts(Gust(period=period, duration=share * period, speed=(1.0, 4.0), seed=3))
    time = (number + part) * period
    for _ in range(4):
        change = gusts.next_change(time)
        # However time was rounded, no change is found twice, and none is passed over.
        assert time < change <= time + period * (1 + 1e-9)
        inside = time + (change - time) * np.array([0.01, 0.3, 0.5, 0.99])
        if change - time > 1e-9 * (time + period):  # elsewhere rounding leaves no inside
            assert len({tuple(gusts.velocity(float(moment))) for moment in inside}) == 1
        time = change
