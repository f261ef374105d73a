import itertools
import math
from concurrent.futures import Future

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.live import error_estimate
from cloth_ros.live.error_estimate import ErrorEstimator
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff.live_error import compare
from cloth_ros.tradeoff.run import Scenario

TICK = 1 / 60


def scene(**changes: object) -> Scene:
    return Scene().with_parameters({'sheet.rows': 12, 'sheet.columns': 12, **changes})


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('config', ['hanging', 'gust', 'drop_on_sphere', 'small_fast_sphere'])
def test_the_estimate_is_within_a_factor_of_three_of_the_truth(config, precision, method):
    ready = Scene.from_yaml(f'config/{config}.yaml').with_parameters(
        {'solver.method': method, 'solver.precision': precision, 'wind.gust.period': 0.0}
    )
    # The sphere comes down on the sheet where there is one; until then nothing is chaotic.
    goal = (0.0, 0.0, 0.9) if config == 'small_fast_sphere' else None
    comparisons = compare(ready, Scenario(0.3, 2 * TICK, goal=goal, arrival=0.3))
    assert len(comparisons) >= 3
    for each in comparisons:
        assert each.truth / 3 < each.estimate < 3 * each.truth, each


@settings(max_examples=8, deadline=None)
@given(
    winds=st.lists(st.tuples(*[st.floats(-5, 5)] * 3), min_size=12, max_size=12),
    parts=st.integers(1, 4),
)
def test_the_twin_is_given_what_the_cloth_was_given(winds, parts):
    """Had it other wind, or other ticks, it would be millimetres away."""
    cloth = Cloth(scene(**{'solver.precision': 'double', 'solver.substeps': 200}))
    monitor = ErrorEstimator(cloth)
    seen = []
    for wind in winds:
        cloth.wind = wind
        for _ in range(parts):
            monitor.observe(TICK / parts)
            cloth.advance(TICK / parts)
        monitor.work(math.inf)
        seen.append(monitor.estimate)
    assert seen[-1] is not None
    assert max(each.largest for each in seen if each is not None) < 1e-5


def test_windows_grow_to_a_second_and_lie_behind_the_present():
    cloth = Cloth(scene())
    monitor = ErrorEstimator(cloth)
    estimates = []
    for _ in range(200):
        monitor.observe(TICK)
        cloth.advance(TICK)
        monitor.work(math.inf)
        if monitor.estimate is not None and monitor.estimate not in estimates:
            estimates.append(monitor.estimate)
            assert monitor.estimate.time < cloth.time
    lengths = [each.seconds for each in estimates]
    assert lengths[0] == pytest.approx(TICK)
    assert lengths == sorted(lengths)
    assert lengths[-1] == pytest.approx(1.0)
    for each in estimates:
        assert 0 < each.rms <= each.largest


def test_nothing_is_done_without_time_and_the_cloth_is_left_alone():
    cloth, alone = Cloth(scene()), Cloth(scene())
    monitor = ErrorEstimator(cloth)
    for number in range(30):
        monitor.observe(TICK)
        cloth.advance(TICK)
        alone.advance(TICK)
        monitor.work(0.0 if number < 20 else math.inf)
        assert (monitor.estimate is None) == (number < 20)
    assert np.array_equal(cloth.positions, alone.positions)


def test_a_restart_forgets_what_was_and_follows_the_new_scene():
    cloth = Cloth(scene())
    monitor = ErrorEstimator(cloth)
    for _ in range(12):
        monitor.observe(TICK)
        cloth.advance(TICK)
        monitor.work(math.inf)
    assert monitor.estimate is not None
    cloth.configure(scene(**{'springs.structural': 5000.0, 'springs.bending': 0.0}))
    cloth.reset()
    monitor.restart()
    assert monitor.estimate is None
    for _ in range(12):
        monitor.observe(TICK)
        cloth.advance(TICK)
        monitor.work(math.inf)
    assert monitor.estimate is not None
    assert monitor.estimate.largest < 1e-3


def test_ticks_that_were_not_observed_are_not_taken_for_an_error():
    """Nobody listens for a while, and the node spares itself the estimate."""
    cloth = Cloth(scene(**{'solver.precision': 'double', 'solver.substeps': 200}))
    monitor = ErrorEstimator(cloth)
    for number in range(60):
        if not 20 <= number < 25:
            monitor.observe(TICK)
        cloth.advance(TICK)
        monitor.work(math.inf)
        if monitor.estimate is not None:
            assert monitor.estimate.largest < 1e-5
    assert monitor.estimate is not None
    assert monitor.estimate.time > 30 * TICK


def test_no_more_time_is_spent_than_was_given(monkeypatch):
    """But for the last substep, which is never divided; by a clock that ticks when it is read."""
    clock = itertools.count(step=1e-4)
    monkeypatch.setattr(error_estimate.time, 'perf_counter', lambda: next(clock))
    cloth = Cloth(scene())
    monitor = ErrorEstimator(cloth)
    given, calls = 0.05 * TICK, 300
    spent = 0.0
    for _ in range(calls):
        monitor.observe(TICK)
        cloth.advance(TICK)
        start = next(clock)
        monitor.work(given)
        spent += next(clock) - start - 2e-4  # the two readings around it
    assert 0.9 * calls * given < spent < calls * given + 5e-4
    assert monitor.estimate is not None


def test_one_finer_solution_at_most_is_being_made_and_a_reset_needs_no_other():
    made: list[tuple[Scene, Future[Cloth]]] = []

    def make_fine(scene: Scene) -> Future[Cloth]:
        made.append((scene, Future()))
        return made[-1][1]

    cloth = Cloth(scene())
    monitor = ErrorEstimator(cloth, make_fine=make_fine)
    for k in range(1, 20):
        cloth.configure(scene(**{'springs.bending': float(k)}))
        monitor.restart()
        monitor.observe(TICK)
    assert len(made) == 1
    for number in range(2):
        wanted, future = made[number]
        future.set_result(Cloth(wanted))
        monitor.observe(TICK)  # it is of the first scene, which is no longer wanted
        monitor.observe(TICK)
    assert [wanted.springs.bending for wanted, _ in made] == [1.0, 19.0]
    cloth.reset()
    monitor.restart()
    for _ in range(3):
        monitor.observe(TICK)
        cloth.advance(TICK)
        monitor.work(math.inf)
    assert monitor.estimate is not None
    assert len(made) == 2


@pytest.mark.parametrize('seconds', [math.nan, -1.0, 'long', None])
def test_time_that_is_none_is_refused(seconds):
    monitor = ErrorEstimator(Cloth(scene()))
    for method in (monitor.observe, monitor.work):
        with pytest.raises(ValueError, match='seconds is'):
            method(seconds)


def test_why_there_is_no_finer_solution_is_reported():
    failed: Future[Cloth] = Future()
    failed.set_exception(MemoryError('no more'))
    monitor = ErrorEstimator(Cloth(scene()), make_fine=lambda _: failed)
    monitor.observe(TICK)
    assert monitor.report() == {'error estimate [m]': 'no finer solution: MemoryError, no more'}
