import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Gust, Scene
from cloth_ros.model.forces.gusts import Gusts

GUST = Gust(period=5.0, duration=1.0, direction=(0, 2, 0), speed=(1.0, 4.0), seed=3)


def test_a_gust_blows_every_period_for_its_duration():
    gusts = Gusts(GUST)
    for time, blows in (
        (0.5, False),
        (4.99, False),
        (5.0, True),
        (5.99, True),
        (6.0, False),
        (10.5, True),
        (1000.1, True),
    ):
        assert gusts.velocity(time).any() == blows, time


def test_speeds_are_drawn_from_the_range_and_differ():
    velocities = np.array([Gusts(GUST).velocity(5.0 * n + 0.5) for n in range(1, 400)])
    speeds = velocities[:, 1]
    assert not velocities[:, [0, 2]].any()
    assert 1.0 <= speeds.min() < 1.1
    assert 3.9 < speeds.max() <= 4.0
    assert speeds.mean() == pytest.approx(2.5, abs=0.2)


def test_gusts_are_a_function_of_seed_and_time_alone():
    forwards, backwards = Gusts(GUST), Gusts(GUST)
    times = [5.1, 10.2, 15.3, 20.4]
    once = [forwards.velocity(time).tolist() for time in times]
    again = [backwards.velocity(time).tolist() for time in reversed(times)]
    assert once == again[::-1]
    other = Gusts(Gust(period=5.0, speed=(1.0, 4.0), seed=4))
    assert other.velocity(5.1).tolist() != once[0]


def test_a_cloth_feels_its_gusts_and_repeats_them_after_a_reset():
    scene = Scene(
        sheet={'rows': 6, 'columns': 6},
        gravity=(0, 0, 0),
        drag=0.0,
        wind={'gust': {'period': 0.5, 'duration': 0.2, 'direction': (0, 0, 1), 'speed': (3, 5)}},
    )
    cloth = Cloth(scene)
    cloth.advance(0.49)
    assert not cloth.velocities[..., 2].any()
    cloth.advance(0.11)
    assert cloth.velocities[..., 2].max() > 0
    assert cloth.air_velocity[2] >= 3
    first = cloth.positions
    cloth.reset()
    cloth.advance(0.49)
    cloth.advance(0.11)
    assert np.array_equal(cloth.positions, first)


@given(
    # None of 0.1, 0.3, 1/3 is a floating point number, nor are their multiples exact.
    period=st.one_of(st.sampled_from([0.1, 0.3, 1 / 3, 0.7, 2.0]), st.floats(1e-3, 1e3)),
    share=st.one_of(st.sampled_from([0.0, 0.1, 0.3, 1.0]), st.floats(0, 1)),
    number=st.integers(0, 10_000),
    part=st.one_of(st.sampled_from([0.0, 0.1, 0.3, 1.0]), st.floats(0, 1)),
)
def test_the_air_is_constant_up_to_the_next_change(period, share, number, part):
    gusts = Gusts(Gust(period=period, duration=share * period, speed=(1.0, 4.0), seed=3))
    time = (number + part) * period
    for _ in range(4):
        change = gusts.next_change(time)
        # However time was rounded, no change is met twice, and none is passed over.
        assert time < change <= time + period * (1 + 1e-9)
        inside = time + (change - time) * np.array([0.01, 0.3, 0.5, 0.99])
        if change - time > 1e-9 * (time + period):  # elsewhere rounding leaves no inside
            assert len({tuple(gusts.velocity(float(moment))) for moment in inside}) == 1
        time = change


@pytest.mark.parametrize('period', [0.1, 0.3, 0.7, 5.0])
def test_the_changes_are_the_edges_of_the_gusts(period):
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
