"""Recommendations and their reasons, over made-up results of studies."""

import math
import re

from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Scene
from cloth_ros.tradeoff import recommendation
from cloth_ros.tradeoff.explanation import (
    grid_parameters,
    recommendation_text,
    share_of_real_time,
)
from cloth_ros.tradeoff.recommendation import SHARE, WORTH, cost, error

# Powers of ten far apart, and neighbours that differ by less than what is worth a cost.
costs = st.sampled_from([0.01, 0.02, 0.3, 0.59, 0.61, 0.99, 1.5, 24.0])
errors = st.sampled_from([0.0, 1e-9, 2e-5, 1e-4, 1.05e-4, 0.012, 0.03, 0.5])
distances = st.sampled_from([1e-7, 1e-4, 0.02, 0.1, 0.242, 1.0])


def entry(cost: float, error: float | None, *, refused: bool = False, **setting: object) -> dict:
    """Return the record of a setting, as far as recommendations read it."""
    auto = {'method': 'auto', 'precision': 'single', 'substeps': 0, 'tolerance': 1e-3}
    return {
        'wall': {'median': cost},
        'error': None if error is None else {'largest': error},
        'refused': refused,
        'unstable': False,
        'together': 0.1,
        'substeps per tick': 1 / cost,
        'setting': {**auto, **setting},
    }


def grid(rows: int, cost: float, largest: float) -> dict:
    """Return the record of a grid."""
    return {
        'rows': rows,
        'columns': rows + 1,
        'bending': 0.05 * rows**2,
        'pins': [],
        'wall': {'median': cost},
        'largest': largest,
    }


def result(settings: list[dict], grids: list[dict], rows: int = 32, **changes: object) -> dict:
    """Return the result of a study, with changes of the course and of the reference by name."""
    course = {'seconds': 1.0, 'wanted': 1.0, 'limited': False, 'expected': 99.0, 'period': 0.1}
    reference = {'horizon': 1.0, 'contact': None, 'apart': []}
    for name, value in changes.items():
        (reference if name in reference else course)[name.replace('_', ' ')] = value
    scene = Scene().with_parameters({'sheet.rows': rows, 'sheet.columns': rows + 1})
    return {
        'quick': False,
        'parameters': scene.flat(),
        'settings': settings,
        'grids': grids,
        'course': {'gust at': None, **course},
        'reference': reference,
    }


@st.composite
def studies(draw: st.DrawFn) -> dict:
    """Return any result: with and without known errors, other grids, contact and gusts."""
    settings = [
        entry(
            draw(costs),
            draw(errors),
            refused=draw(st.integers(0, 5)) == 0,
            precision=draw(st.sampled_from(['single', 'double'])),
            tolerance=draw(st.sampled_from([1e-2, 1e-3, 1e-4, 1e-5])),
            substeps=draw(st.sampled_from([0, 0, 0, 50])),
        )
        for _ in range(draw(st.integers(1, 8)))
    ]
    sides = sorted({32, *draw(st.sets(st.sampled_from([9, 17, 63, 125])))})
    grids = [grid(side, draw(costs), draw(distances)) for side in sides]
    grids[-1]['largest'] = 0.0
    seconds = draw(st.sampled_from([0.3, 1.0]))
    horizon = draw(st.sampled_from([0.0, 0.2, seconds]))
    if horizon == 0:
        for each in settings:
            each['error'] = None
    times = sorted(draw(st.lists(st.sampled_from([0.25, 0.3]), max_size=2)))
    return result(
        settings,
        grids,
        seconds=seconds,
        limited=seconds < 1,
        horizon=horizon,
        contact=draw(st.sampled_from([None, 0.2, 0.9])),
        gust_at=draw(st.sampled_from([None, 0.1, 0.9])),
        apart=[{'distance': 10.0 ** (n - 4), 'time': t} for n, t in enumerate(times)],
    )


def total(study: dict, each: dict) -> float:
    found = recommendation.grid_error(study)
    return math.hypot(error(each), found.distance if found else 0.0)


@given(studies())
def test_the_cheapest_setting_is_recommended_that_no_other_one_improves_on_in_real_time(study):
    choice, known = recommendation.choose(study), recommendation.usable(study)
    affordable = [each for each in known if cost(each) <= SHARE]
    assert (choice.setting is None) == (not affordable)
    assert choice.setting is None or choice.setting in affordable
    for each in affordable:
        assert total(study, choice.setting) <= WORTH * total(study, each)
        assert cost(each) >= cost(choice.setting) or (
            total(study, each) > WORTH * min(total(study, other) for other in affordable)
        )
    if choice.grid and affordable and choice.grid.distance > 10 * max(map(error, affordable)):
        assert choice.grid_dominates
        assert cost(choice.setting) == min(map(cost, affordable))


@given(studies(), st.sampled_from([1.5, 100.0, 1e5]))
def test_a_grid_that_is_further_off_never_makes_the_recommendation_dearer(study, factor):
    before = recommendation.choose(study).setting
    for each in study['grids']:
        each['largest'] *= factor
    after = recommendation.choose(study).setting
    assert (before is None) == (after is None)
    assert before is None or cost(after) <= cost(before)


def test_double_precision_is_not_recommended_for_a_grid_that_is_far_off():
    settings = [entry(0.05, 0.03), entry(0.53, 0.012, precision='double', tolerance=1e-4)]
    grids = [grid(16, 0.01, 0.3), grid(32, 0.05, 0.242), grid(63, 0.4, 0.0)]
    study = result(settings, grids, horizon=0.367, apart=[{'distance': 1e-3, 'time': 0.4}])
    assert recommendation.choose(study).setting is settings[0]
    text = recommendation_text(study)
    for part in (
        'precision: single, tolerance: 0.001}`, 5 % of real time',
        '30 mm from time step and precision, 242 mm or more from the grid',
        'double precision costs more and gains nothing',
        'take a finer grid: `{sheet.rows: 63',
        'After 0.37 s',
        'cloth that folds is chaotic',
    ):
        assert part in text


def test_of_equal_settings_one_is_recommended_as_a_scene_takes_it():
    cheap, loose = entry(0.5, 1e-5), entry(0.5, 1e-5, tolerance=1.0)
    # A stiff and light cloth is simulated in double precision in any case.
    double = {**entry(0.5, 1e-5, precision='double'), 'wall': {'median': 0.49}}
    fixed, refused = entry(0.01, 1e-9, substeps=50), entry(0.01, 1e-9, refused=True)
    unknown = entry(0.02, None)
    study = result([double, loose, cheap, fixed, refused, unknown], [])
    assert recommendation.usable(study) == [cheap]
    assert fixed in recommendation.candidates(study)
    assert recommendation.choose(study).setting is recommendation.for_accuracy(study) is cheap
    study = result([entry(2.0, 1.0), refused], [])
    assert recommendation.choose(study).setting is recommendation.for_accuracy(study) is None


@given(studies())
def test_every_setting_and_grid_is_named_with_its_cost_and_slow_ones_are_called_slow(study):
    found = {f'`{grid_parameters(each)}`': [each] for each in study['grids']}
    for each in recommendation.usable(study):
        found.setdefault(f'`{recommendation.parameters(each)}`', []).append(each)
    text = recommendation_text(study)
    for name, rest in re.findall(r'(`[^`]*{[^`]*`)([^`]*)', text):
        assert any(share_of_real_time(cost(each)) in rest for each in found[name])
    for each in (cost(each) for all_of_one in found.values() for each in all_of_one):
        slow = f'slower than real time (a simulated second takes {each:.3g} s)'
        assert (share_of_real_time(each) == slow) == (each > 1)


@given(studies())
def test_reasons_are_those_of_the_study(study):
    text, course, reference = recommendation_text(study), study['course'], study['reference']
    choice, horizon = recommendation.choose(study), reference['horizon']
    assert ("grid's error dominates" in text) == choice.grid_dominates
    assert ('Simulated time' in text) == course['limited']
    ends = horizon < course['seconds']
    assert ('errors are not known' in text) == ends
    touched = reference['contact'] is not None and reference['contact'] < horizon + 0.25
    gust = course['gust at'] is not None and course['gust at'] <= horizon
    parted = ends and bool(reference['apart'])
    assert ('two reference solutions' in text) == parted
    assert ('touches the sphere' in text) == (parted and touched)
    assert ('gust' in text) == (parted and gust and not touched)
    assert ('folds is chaotic' in text) == (parted and not touched)
    assert all(line.startswith(('* ', '  * ')) for line in text.splitlines())


def test_a_setting_or_a_grid_is_a_line_of_a_scene_file(tmp_path):
    for pins in ([], ['0,::5', '-1,0']):
        parameters = grid_parameters({**grid(17, 0.1, 0.0), 'pins': pins, 'bending': 1e-6})
        path = tmp_path / 'scene.yaml'
        path.write_text(f'/**:\n  ros__parameters: {parameters}\n')
        scene = Scene.from_yaml(path)
        assert (scene.sheet.rows, scene.sheet.columns, scene.springs.bending) == (17, 18, 1e-6)
        assert list(scene.pins) == (pins or list(Scene().pins))


def test_a_finer_grid_is_recommended_only_where_it_is_in_real_time_and_nearer():
    def finer(*grids: dict) -> int | None:
        study = result([entry(0.1, 1e-3)], [grid(9, 0.1, 0.3), *grids])
        found = recommendation.finer_grid(study)
        return None if found is None else found['rows']

    own = grid(32, 0.1, 0.2)
    assert finer(own, grid(63, 0.2, 0.1), grid(125, 0.5, 0.0)) == 125
    assert finer(own, grid(63, 0.2, 0.1), grid(125, 0.7, 0.0)) == 63
    assert finer(own, grid(63, 0.7, 0.1), grid(125, 5.0, 0.0)) is None
    assert finer(own, grid(63, 0.2, 0.25), grid(125, 0.5, 0.0)) is None
    assert finer(grid(32, 0.1, 0.0)) is None


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(1, 9)), max_size=12, unique=True))
def test_the_frontier_is_what_no_other_setting_beats(pairs):
    best = recommendation.frontier([entry(*pair) for pair in pairs])
    found = {(cost(each), error(each)) for each in best}
    for pair in pairs:
        beaten = any(c <= pair[0] and e <= pair[1] for c, e in pairs if (c, e) != pair)
        assert (pair in found) != beaten
