"""Gusts: periodic, of random speed, a function of seed and time."""

import numpy as np
import pytest
from builders import examples, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Gust
from cloth_ros.model.forces.gusts import Gusts

GUST = Gust(period=5.0, duration=1.0, direction=(0, 2, 0), speed=(1.0, 4.0), seed=3)


@pytest.mark.parametrize('period', [0.1, 0.3, 0.7, 5.0])
def test_a_gust_blows_from_every_period_on_for_its_duration(period):
    gusts = Gusts(Gust(period=period, duration=0.25 * period, speed=(1.0, 4.0)))
    edges, blows = [], []
    time = 0.5 * period
    for _ in range(200):
        edges.append(gusts.next_change(time))
        blows.append(gusts.velocity(0.5 * (time + edges[-1])).any())
        time = edges[-1]
    numbers = np.arange(1, 101)
    expected = np.stack([numbers, numbers + 0.25], 1).ravel() * period
    np.testing.assert_allclose(edges, expected, rtol=1e-12)
    assert blows == [False, True] * 100


def test_speeds_are_uniform_in_their_range():
    velocities = np.array([Gusts(GUST).velocity(5.0 * n + 0.5) for n in range(1, 400)])
    speeds = velocities[:, 1]
    assert not velocities[:, [0, 2]].any()
    assert 1.0 <= speeds.min() < 1.1
    assert 3.9 < speeds.max() <= 4.0
    assert speeds.mean() == pytest.approx(2.5, abs=0.2)


def test_gusts_are_a_function_of_seed_and_time():
    forwards, backwards = Gusts(GUST), Gusts(GUST)
    times = [5.1, 10.2, 15.3, 20.4]
    once = [forwards.velocity(time).tolist() for time in times]
    again = [backwards.velocity(time).tolist() for time in reversed(times)]
    assert once == again[::-1]
    other = Gusts(Gust(period=5.0, speed=(1.0, 4.0), seed=4))
    assert other.velocity(5.1).tolist() != once[0]


@examples(1)
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


def test_gusts_move_a_cloth_and_add_to_the_wind():
    gust = {'period': 0.5, 'duration': 0.2, 'direction': (0, 0, 1), 'speed': (3, 5)}
    cloth = small_cloth(gravity=(0, 0, 0), drag=0.0, wind__gust=gust)
    cloth.advance(0.49)
    assert not cloth.velocities[..., 2].any()
    cloth.advance(0.11)
    assert cloth.velocities[..., 2].max() > 0
    cloth.wind = (1.0, 0.0, 0.0)
    assert cloth.air_velocity[0] == 1.0
    assert 3 <= cloth.air_velocity[2] <= 5
