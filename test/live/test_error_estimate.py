"""The error estimate: against the true error, with other inputs, and in limited time."""

import itertools
import math
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, SCENE_FILES, cloth_of, examples, scene_of
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.live import error_estimate
from cloth_ros.live.error_estimate import ErrorEstimate, ErrorEstimator
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff.live_error import compare
from cloth_ros.tradeoff.run import Scenario

TICK = 1 / 60
# The rounding of this one is below 1 nm, and the error of its substeps below 10 µm.
ACCURATE = {'solver__precision': 'double', 'solver__substeps': 200}


def scene(**changes: object) -> Scene:
    return scene_of(**{'sheet__rows': 12, 'sheet__columns': 12, **changes})


def scene_file(path: Path) -> object:
    """Return a scene file as a parameter of tests: slow, if its colliders need kernels."""
    colliders = bool(Scene.from_yaml(path).colliders)
    return pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if colliders else [])


def run(
    cloth: Cloth, estimator: ErrorEstimator, ticks: int, work: float = math.inf
) -> list[ErrorEstimate]:
    """Advance a cloth, and return the estimates, those that are made anew only."""
    estimates: list[ErrorEstimate] = []
    for _ in range(ticks):
        before = estimator.estimate
        estimator.observe(TICK)
        cloth.advance(TICK)
        estimator.work(work)
        if estimator.estimate is not None and estimator.estimate is not before:
            estimates.append(estimator.estimate)
    return estimates


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('precision', ['single', pytest.param('double', marks=pytest.mark.slow)])
@pytest.mark.parametrize('path', [scene_file(path) for path in SCENE_FILES])
def test_the_estimate_is_within_a_factor_of_three_of_the_truth(path, precision, method):
    ready = Scene.from_yaml(path).with_parameters(
        {'solver.method': method, 'solver.precision': precision, 'wind.gust.period': 0.0}
    )
    # The sphere comes down on the sheet where there is one; until then nothing is chaotic.
    goal = (0.0, 0.0, 0.9) if path.stem == 'small_fast_sphere' else None
    comparisons = compare(ready, Scenario(0.3, 2 * TICK, goal=goal, arrival=0.3))
    assert len(comparisons) >= 3
    for each in comparisons:
        # Both are 0 as long as a sheet falls freely.
        assert each.truth / 3 <= each.estimate <= 3 * each.truth, each


@examples(0.05)
@given(
    winds=st.lists(st.tuples(*[st.floats(-5, 5)] * 3), min_size=12, max_size=12),
    parts=st.integers(1, 4),
    unobserved=st.sets(st.integers(1, 11), max_size=3),
)
def test_the_finer_solution_is_given_the_inputs_of_the_cloth(winds, parts, unobserved):
    """
    With another wind, or other ticks, it would be millimetres away.

    Windows in which a tick was not observed, as while nobody listens, are discarded.
    """
    cloth = Cloth(scene(**ACCURATE))
    estimator, seen = ErrorEstimator(cloth), []
    for number, wind in enumerate(winds):
        cloth.wind = wind
        for _ in range(parts):
            if number not in unobserved:
                estimator.observe(TICK / parts)
            cloth.advance(TICK / parts)
        estimator.work(math.inf)
        seen.append(estimator.estimate)
    assert unobserved or seen[-1] is not None
    assert max((each.largest for each in seen if each is not None), default=0.0) < 1e-5


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_windows_grow_to_a_second_and_the_cloth_is_only_read(precision):
    cloth, alone = (Cloth(scene(solver__precision=precision)) for _ in range(2))
    estimator = ErrorEstimator(cloth)
    assert not run(cloth, estimator, 20, work=0.0)
    assert estimator.report() == {'error estimate [m]': 'not yet sampled'}
    estimates = run(cloth, estimator, 180)
    lengths = [each.seconds for each in estimates]
    assert lengths[0] == pytest.approx(TICK)
    assert lengths == sorted(lengths)
    assert lengths[-1] == pytest.approx(1.0)
    for each in estimates:
        assert 0 < each.rms <= each.largest
        assert each.time < cloth.time
    last, age = estimates[-1], cloth.time - estimates[-1].time
    assert list(estimator.report().values()) == [last.largest, last.rms, last.seconds, age]
    assert 0 < age < 2.1  # up to a window more, and one that is not complete
    for _ in range(200):
        alone.advance(TICK)
    assert np.array_equal(cloth.positions, alone.positions)


def test_a_slow_evaluation_halves_the_window(monkeypatch):
    clock = itertools.count(step=0.1)
    monkeypatch.setattr(error_estimate.time, 'perf_counter', lambda: next(clock))
    cloth = Cloth(scene())
    estimates = run(cloth, ErrorEstimator(cloth), 300)
    lengths = [each.seconds for each in estimates]
    assert max(lengths) < 0.7
    assert any(b == pytest.approx(a / 2, abs=TICK) for a, b in itertools.pairwise(lengths))


def test_a_window_is_shorter_where_the_solutions_part():
    """A free sheet that crumples in the wind: a distance beyond 1/20 of the spacing halves it."""
    cloth = Cloth(scene(pins=[''], wind__velocity=(0.0, 8.0, 2.0), sheet__rows=24))
    close = 0.05 * cloth.scene.sheet.shortest_spacing
    estimates = run(cloth, ErrorEstimator(cloth), 240)
    pairs = list(itertools.pairwise(estimates))
    assert any(first.largest > close for first, _ in pairs)
    for first, second in pairs:
        if first.largest > close:
            assert second.seconds <= 0.5 * first.seconds + TICK
        else:
            assert second.seconds == pytest.approx(min(2 * first.seconds, 1.0), abs=TICK)


def test_a_restart_follows_the_new_scene_and_another_cloth():
    cloth = Cloth(scene())
    estimator = ErrorEstimator(cloth)
    assert run(cloth, estimator, 12)
    cloth.configure(scene(springs__structural=5000.0, springs__bending=1.0))
    cloth.reset()
    estimator.restart()
    assert estimator.estimate is None
    assert max(each.largest for each in run(cloth, estimator, 12)) < 1e-3
    other = Cloth(scene(**ACCURATE))
    estimator.restart(other)
    assert estimator.estimate is None
    assert 0 < max(each.largest for each in run(other, estimator, 12)) < 1e-5


def test_no_more_time_is_spent_than_was_given(monkeypatch):
    """Except for the last substep, which is never divided; by a clock that counts readings."""
    clock = itertools.count(step=1e-4)
    monkeypatch.setattr(error_estimate.time, 'perf_counter', lambda: next(clock))
    cloth = Cloth(scene())
    estimator = ErrorEstimator(cloth)
    allowed, calls, spent = 0.05 * TICK, 300, 0.0
    for _ in range(calls):
        estimator.observe(TICK)
        cloth.advance(TICK)
        start = next(clock)
        estimator.work(allowed)
        spent += next(clock) - start - 2e-4  # the two readings around it
    assert 0.9 * calls * allowed < spent < calls * allowed + 5e-4
    assert estimator.estimate is not None


def test_one_finer_solution_at_most_is_made_at_a_time_and_a_reset_needs_no_other():
    made: list[tuple[Scene, Future[Cloth]]] = []

    def make_fine(scene: Scene) -> Future[Cloth]:
        made.append((scene, Future()))
        return made[-1][1]

    cloth = Cloth(scene())
    estimator = ErrorEstimator(cloth, make_fine=make_fine)
    for k in range(1, 20):
        cloth.configure(scene(springs__bending=float(k)))
        estimator.restart()
        estimator.observe(TICK)
    assert len(made) == 1
    for number in range(2):
        wanted, future = made[number]
        future.set_result(Cloth(wanted))
        estimator.observe(TICK)  # the first is of a scene that is no longer wanted
        estimator.observe(TICK)
    assert [wanted.springs.bending for wanted, _ in made] == [1.0, 19.0]
    cloth.reset()
    estimator.restart()
    assert run(cloth, estimator, 3)
    assert len(made) == 2


def test_the_reason_why_there_is_no_finer_solution_is_reported(monkeypatch):
    failed: Future[Cloth] = Future()
    failed.set_exception(MemoryError('no more'))
    cloth = Cloth(scene())
    monkeypatch.setattr(error_estimate, 'fine_solution', lambda _: failed.result())
    # One that is made elsewhere, and one that the estimator makes itself.
    for estimator in (ErrorEstimator(cloth, make_fine=lambda _: failed), ErrorEstimator(cloth)):
        estimator.observe(TICK)
        text = 'no finer solution: MemoryError, no more'
        assert estimator.report() == {'error estimate [m]': text}


@pytest.mark.parametrize('seconds', [math.nan, -1.0, 'long', None])
def test_an_invalid_time_is_refused(seconds):
    estimator = ErrorEstimator(Cloth(scene()))
    for method in (estimator.observe, estimator.work):
        with pytest.raises(ValueError, match='seconds is'):
            method(seconds)


def test_the_finer_solution_takes_part_in_grasps_and_motions_of_grippers():
    """Without them, its sheet would fall."""
    hand = {'position': (-0.25, -0.25, 1.0), 'radius': 0.08}
    cloth = cloth_of(
        sheet={'rows': 12, 'columns': 12, 'size': (0.5, 0.5)}, pins=[''], **NEGLIGIBLE_AIR,
        gripper={'names': ['hand'], 'hand': hand}, solver__precision='double',
    )  # fmt: skip
    estimator = ErrorEstimator(cloth)
    for tick in range(40):
        if tick % 8 == 0:
            cloth.grasp('hand')
        cloth.move_gripper('hand', (-0.25, -0.25, 1.0 + 0.01 * tick))
        estimator.observe(1 / 60)
        cloth.advance(1 / 60)
        if tick == 20:
            cloth.release('hand')
        estimator.work(math.inf)
    assert estimator.estimate.seconds > 0.1
    assert 0 < estimator.estimate.largest < 0.01
