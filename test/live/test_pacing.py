"""Pacing, under injected times and costs."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cloth_ros.live.pacing import Pacing

TICK = 1 / 60


def tick(pacing, substep, cost, elapsed=TICK, period=TICK, max_tick=0.1) -> int:
    """Simulate a tick whose substeps cost so much each, s, and return their number."""
    count = pacing.due(elapsed, substep, period, max_tick, period)
    if count:
        pacing.done(count, substep, count * cost, count * cost)
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
        assert -0.5001 * substep <= pacing.pending <= max(max_tick, 1.5 * TICK) + 1.001 * substep
    forwards = sum(max(seconds, 0.0) for seconds in elapsed)
    assert simulated + pacing.pending + pacing.lost == pytest.approx(forwards, abs=1e-4)
    known = forwards >= substep  # a part of a substep tells nothing about the speed
    expected = simulated / forwards if known else 0.0
    assert pacing.take_report().real_time_factor == pytest.approx(expected)


@st.composite
def clock_steps(draw: st.DrawFn) -> tuple[float, int, float, list[int]]:
    """Draw rate, substeps a tick, max_tick and steps of a clock, ns, none too long for a tick."""
    rate, max_tick = draw(st.floats(1.0, 1000.0)), draw(st.floats(1e-3, 10.0))
    longest = int(1e9 * max(max_tick, 1.5 / rate))
    steps = st.integers(1, longest) | st.sampled_from([longest, max(longest // 67, 1), 1, 10**5])
    clipped = st.lists(steps.map(lambda step: min(step, longest)), min_size=1, max_size=100)
    return rate, draw(st.integers(1, 20_000)), max_tick, draw(clipped)


@given(clock_steps())
def test_a_machine_that_is_fast_enough_loses_no_time_by_rounding(drawn):
    """Also where the longest step of a tick follows finer ones: remainders are carried."""
    rate, substeps, max_tick, steps = drawn
    pacing, substep, now, simulated = Pacing(), 1 / rate / substeps, 10**15, 0
    for step in steps:
        last, now = now, now + step
        # As a clock is read: two times in seconds, each rounded.
        elapsed = 1e-9 * (now - last) if step % 2 else 1e-9 * now - 1e-9 * last
        simulated += tick(pacing, substep, 1e-12, elapsed, 1 / rate, max_tick)
    report = pacing.take_report()
    assert (pacing.lost, report.lost) == (0.0, 0.0)
    passed = 1e-9 * (now - 10**15)
    assert abs(simulated * substep - passed) <= 0.5001 * substep + 1e-6
    if passed > 2 * substep:
        assert abs(report.real_time_factor - 1) <= (0.5001 * substep + 1e-6) / passed


@given(st.floats(1e-3, 10.0), st.integers(1, 1000), st.floats(0.0, 1.0))
def test_lost_time_is_reported_from_a_thousandth_of_the_time_on(max_tick, substeps, share):
    """A tick that is late by so much more than `max_tick`."""
    pacing, substep = Pacing(), TICK / substeps
    longest = max(max_tick, 1.5 * TICK)
    late = share * longest
    tick(pacing, substep, 1e-12, longest + late, max_tick=max_tick)
    lost = pacing.lost
    assert lost == pytest.approx(late if late > substep else 0.0, abs=1e-9)
    noticeable = lost > 1e-3 * (longest + late)
    assert pacing.take_report().lost == (lost if noticeable else 0.0)


@given(
    rate=st.floats(1.0, 1000.0),
    lateness=st.lists(st.floats(-0.2, 0.2), min_size=1, max_size=200),
    substeps=st.integers(1, 50),
    max_tick=st.floats(1e-3, 0.1),
)
@example(rate=1.0, lateness=[-0.125], substeps=1, max_tick=0.0625)  # less than a substep passes
def test_jitter_neither_adds_up_nor_loses_time_at_any_rate(rate, lateness, substeps, max_tick):
    pacing, period, late, total = Pacing(), 1 / rate, 0.0, 0
    for share in lateness:  # of a period, by which this tick is late, or early
        elapsed, late = (1 + share - late) * period, share
        count = tick(pacing, period / substeps, 1e-9, elapsed, period, max_tick)
        assert count == 1 or substeps > 1  # one substep a tick is one at each
        total += count
    assert abs(total - (len(lateness) + late) * substeps) <= 0.5001
    report = pacing.take_report()
    assert report.lost == 0
    # Half a substep may be missing, or simulated ahead; less than one tells nothing.
    passed = (len(lateness) + late) * substeps
    if passed >= 1:
        assert report.real_time_factor == pytest.approx(1.0, abs=0.5001 / passed)
    elif passed < 1 - 1e-5:
        assert report.real_time_factor == 0


@given(st.floats(1.2, 50.0), st.integers(1, 200))
def test_an_overloaded_machine_keeps_its_ticks_and_loses_time(load, substeps):
    pacing, substep = Pacing(), TICK / substeps
    elapsed = TICK
    for n in range(300):
        count = tick(pacing, substep, load * substep, elapsed)
        wall = count * load * substep
        assert wall <= 0.8001 * TICK or count == 1 or n == 0
        elapsed = max(wall, TICK)
    report = pacing.take_report()
    assert 0 < report.real_time_factor < 1
    assert report.lost > 0
    assert report.cost == pytest.approx(load * substep)
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
        cpu = count * 0.1 * substep
        pacing.done(count, substep, 10.0 if n == 100 else cpu, cpu)
        if late:  # made up as far as max_tick
            assert count == 240 or n == 101
            report = pacing.take_report()
            assert report.lost == pytest.approx(9.9, abs=0.1)
            assert report.wall - report.cpu == pytest.approx(10.0 if n > 100 else 0.0, abs=0.1)
            assert report.cost == pytest.approx(0.1 * substep)
    assert pacing.take_report().lost == 0
    assert pacing.pending < substep


def test_a_rise_of_the_cost_is_noticed_within_three_ticks():
    pacing, substep = Pacing(), TICK / 40
    for n in range(103):
        tick(pacing, substep, (50 if n >= 100 else 0.1) * substep)
    assert pacing.due(TICK, substep, TICK, 0.1, TICK) <= 4


def test_a_report_without_a_tick_keeps_the_factor_and_discarded_time_is_not_made_up():
    pacing = Pacing()
    tick(pacing, 0.1, 1e-4, 0.96, 1.0)
    factor = pacing.take_report().real_time_factor
    assert factor == pytest.approx(1.0 / 0.96)
    assert pacing.take_report() == (factor, 0.0, 0.0, 0.0, 0)
    pacing.due(0.09, 0.2, 1.0, 0.1, 1.0)
    pacing.discard()
    assert pacing.pending == pacing.lost == 0
