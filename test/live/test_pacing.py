"""Pacing, under injected times and costs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.live.pacing import Pacing

TICK = 1 / 60


def tick(pacing, substep, cost, elapsed=TICK, period=TICK, max_tick=0.1) -> int:
    """Simulate a tick whose substeps cost so much each, s, and return their number."""
    count = pacing.due(elapsed, substep, period, max_tick, period)
    if count:
        pacing.done(count, substep, count * cost)
    return count


@given(
    st.lists(st.floats(-0.5, 0.5), min_size=1, max_size=200),
    st.floats(1e-5, TICK),
    st.floats(1e-3, 10.0),
    st.floats(0, 1e-3),
)
def test_time_is_simulated_pending_or_lost_and_nothing_else(elapsed, substep, max_tick, cost):
    pacing, simulated = Pacing(), 0.0
    for seconds in elapsed:
        count = tick(pacing, substep, cost, seconds, max_tick=max_tick)
        assert count >= 0
        simulated += count * substep
        assert -0.5001 * substep <= pacing.pending <= max(max_tick, 1.5 * TICK) + 1e-9
    forwards = sum(max(seconds, 0.0) for seconds in elapsed)
    assert simulated + pacing.pending + pacing.lost == pytest.approx(forwards, abs=1e-4)
    assert pacing.take_report()[0] == pytest.approx(simulated / forwards if forwards else 0.0)


@given(
    rate=st.floats(1.0, 1000.0),
    lateness=st.lists(st.floats(-0.2, 0.2), min_size=1, max_size=200),
    substeps=st.integers(1, 50),
    max_tick=st.floats(1e-3, 0.1),
)
def test_jitter_neither_adds_up_nor_loses_time_at_any_rate(rate, lateness, substeps, max_tick):
    pacing, period, late, total = Pacing(), 1 / rate, 0.0, 0
    for share in lateness:  # of a period, by which this tick is late, or early
        elapsed, late = (1 + share - late) * period, share
        count = tick(pacing, period / substeps, 1e-9, elapsed, period, max_tick)
        assert count == 1 or substeps > 1  # one substep a tick is one at each
        total += count
    assert abs(total - (len(lateness) + late) * substeps) <= 0.5001
    factor, lost = pacing.take_report()
    assert lost == 0
    # Half a substep may be missing, or simulated ahead.
    assert factor == pytest.approx(1.0, abs=0.5001 / (len(lateness) + late) / substeps)


@given(st.floats(1.2, 50.0), st.integers(1, 200))
def test_an_overloaded_machine_keeps_its_ticks_and_loses_time(load, substeps):
    pacing, substep = Pacing(), TICK / substeps
    elapsed = TICK
    for n in range(300):
        count = tick(pacing, substep, load * substep, elapsed)
        wall = count * load * substep
        assert wall <= 0.8001 * TICK or count == 1 or n == 0
        elapsed = max(wall, TICK)
    factor, lost = pacing.take_report()
    assert 0 < factor < 1
    assert lost > 0
    assert pacing.load(substep) == pytest.approx(load)


def test_an_expected_cost_bounds_the_first_tick():
    pacing = Pacing()
    pacing.expect(1e-3)
    assert pacing.due(0.1, 1e-6, TICK, 0.1, TICK) == 13


def test_a_process_that_was_stopped_within_a_tick_has_not_become_slow():
    pacing, substep = Pacing(), TICK / 40
    for n in range(200):
        late = n in (50, 101)
        count = pacing.due(10.0 if late else TICK, substep, TICK, 0.1, TICK)
        pacing.done(count, substep, 10.0 if n == 100 else count * 0.1 * substep)
        if late:  # made up as far as max_tick
            assert count == 240 or n == 101
            assert pacing.take_report()[1] == pytest.approx(9.9, abs=0.1)
    assert pacing.take_report()[1] == 0
    assert pacing.pending < substep


def test_a_rise_of_the_cost_is_noticed_within_three_ticks():
    pacing, substep = Pacing(), TICK / 40
    for n in range(103):
        tick(pacing, substep, (50 if n >= 100 else 0.1) * substep)
    assert pacing.due(TICK, substep, TICK, 0.1, TICK) <= 4


def test_a_report_without_a_tick_keeps_the_factor_and_discarded_time_is_not_made_up():
    pacing = Pacing()
    tick(pacing, 0.1, 1e-4, 0.96, 1.0)
    factor, _ = pacing.take_report()
    assert factor == pytest.approx(1.0 / 0.96)
    assert pacing.take_report() == (factor, 0.0)
    pacing.due(0.09, 0.2, 1.0, 0.1, 1.0)
    pacing.discard()
    assert pacing.pending == pacing.lost == 0
