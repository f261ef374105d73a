import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.node.pacing import Pacing

TICK = 1 / 60
elapsed_times = st.lists(st.floats(-0.5, 0.5), min_size=1, max_size=200)


@given(elapsed_times, st.floats(1e-5, TICK), st.floats(1e-3, 10.0), st.floats(0, 1e-3))
def test_time_is_simulated_pending_or_lost_and_nothing_else(elapsed, substep, max_tick, cost):
    pacing, simulated = Pacing(), 0.0
    for seconds in elapsed:
        count = pacing.due(seconds, substep, TICK, max_tick)
        assert count >= 0
        if count:
            pacing.done(count, substep, count * cost)
            simulated += count * substep
        assert -0.5001 * substep <= pacing.pending <= max(max_tick, substep) + 1e-9
    forwards = sum(max(seconds, 0.0) for seconds in elapsed)
    assert simulated + pacing.pending + pacing.lost == pytest.approx(forwards, abs=1e-4)


def test_jitter_does_not_add_up():
    pacing, total = Pacing(), 0
    substep = TICK / 44
    for n in range(6000):
        jitter = 0.003 if n % 2 else -0.003
        count = pacing.due(TICK + jitter, substep, TICK, 0.1)
        pacing.done(count, substep, 1e-4)
        total += count
    assert abs(total - 6000 * 44) <= 44
    factor, lost = pacing.take_report()
    assert factor == pytest.approx(1.0, abs=1e-3)
    assert lost == 0


def test_one_substep_a_tick_is_one_at_every_tick():
    pacing = Pacing()
    for n in range(1000):
        count = pacing.due(TICK + (2e-4 if n % 3 else -4e-4), TICK, TICK, 0.1)
        assert count == 1
        pacing.done(count, TICK, 1e-4)


def test_what_is_expected_bounds_the_first_tick():
    pacing = Pacing()
    pacing.expect(1e-3)
    assert pacing.due(0.1, 1e-6, TICK, 0.1) == 13


def test_an_overloaded_machine_keeps_the_ticks_and_loses_time():
    pacing, substep = Pacing(), TICK / 100
    cost = 2 * substep  # twice as slow as real time
    elapsed = TICK
    for _ in range(300):
        count = pacing.due(elapsed, substep, TICK, 0.1)
        wall = count * cost
        pacing.done(count, substep, wall)
        elapsed = max(wall, TICK)
    assert wall <= TICK
    factor, lost = pacing.take_report()
    assert 0.3 < factor < 0.5
    assert lost > 0
    assert pacing.load(substep) == pytest.approx(2, rel=0.01)


def test_a_stall_is_made_up_as_far_as_allowed():
    pacing, substep = Pacing(), TICK / 10
    pacing.done(1, substep, 1e-6)
    assert pacing.due(10.0, substep, TICK, 0.1) == 60
    assert pacing.lost == pytest.approx(9.9, abs=2 * substep)
