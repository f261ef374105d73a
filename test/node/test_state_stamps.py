"""Stamps of states that go on after steps that were faster than the clock."""

import itertools

from cloth_ros.node.state_stamps import StateStamps

SECOND = 10**9


def test_stamps_increase_until_the_clock_has_caught_up():
    stamps = StateStamps()
    stamps.restart(100 * SECOND)
    seen = [stamps.stamp]
    for _ in range(10):
        stamps.step(0.5)
        seen.append(stamps.stamp)
    for tick in range(1, 120):
        stamps.tick(100 * SECOND + tick * SECOND // 20, 0.001, jumped=False)
        seen.append(stamps.stamp)
    assert all(one < two for one, two in itertools.pairwise(seen))
    assert seen[-1] == 100 * SECOND + 119 * SECOND // 20 - SECOND // 1000


def test_a_clock_that_is_set_back_is_followed():
    for now, jumped in ((50 * SECOND, False), (103 * SECOND, True)):
        stamps = StateStamps()
        stamps.restart(100 * SECOND)
        for _ in range(10):
            stamps.step(0.5)
        stamps.tick(now, 0.0, jumped=jumped)
        assert stamps.stamp == now
