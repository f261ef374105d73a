"""What is made of results: validity of the reference, recommendations, cache."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.tradeoff import cache, recommendation
from cloth_ros.tradeoff.reference_solution import horizon, time_together


def entry(cost: float, error: float | None, refused: bool = False, **setting: object) -> dict:
    """Return the record of a setting, as far as recommendations read it."""
    auto = {'method': 'auto', 'precision': 'single', 'substeps': 0, 'tolerance': 1e-3}
    return {
        'wall': {'median': cost},
        'error': None if error is None else {'largest': error},
        'refused': refused,
        'substeps per tick': 1 / cost,
        'setting': {**auto, **setting},
    }


def test_the_horizon_ends_where_the_levels_of_the_reference_diverge():
    between = np.array([1e-12, 1e-6, 1e-5, 1e-2, 1e-6])
    error = np.array([1e-9, 1e-4, 1e-3, 1e-2, 1e-2])
    found = horizon(between, [error, 10 * error])
    assert (found.samples, found.agreement, found.smallest_error) == (3, 1e-5, 1e-3)
    assert horizon(between, [0 * error]).samples == 1
    times = np.array([0.1, 0.2, 0.3])
    for apart, expected in (([0.0, 0.02, 0.0], 0.2), ([0.0, 0.0, 0.0], 0.3), ([], 0.0)):
        assert time_together(np.array(apart), times, 1.0) == expected


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(1, 9)), max_size=12, unique=True))
def test_the_frontier_is_what_no_other_setting_beats(pairs):
    best = recommendation.frontier([entry(*pair) for pair in pairs])
    found = {(recommendation.cost(each), recommendation.error(each)) for each in best}
    for cost, error in pairs:
        beaten = any(c <= cost and e <= error for c, e in pairs if (c, e) != (cost, error))
        assert ((cost, error) in found) != beaten


def test_the_best_of_the_settings_that_a_scene_accepts_are_recommended():
    slow, cheap, accurate = entry(0.9, 1e-6), entry(0.1, 5e-5), entry(0.5, 1e-5)
    loose, fixed = entry(0.5, 1e-5, tolerance=1.0), entry(0.01, 1e-9, substeps=50)
    refused, unknown = entry(0.01, 1e-9, refused=True), entry(0.02, None)
    result = {'settings': [slow, cheap, loose, accurate, fixed, refused, unknown]}
    assert fixed in recommendation.candidates(result)
    assert loose not in recommendation.usable(result)  # as `accurate`, but promises less
    assert recommendation.for_real_time(result) is accurate
    assert recommendation.for_accuracy(result) is cheap
    result['settings'] = [entry(2.0, 1.0), refused]
    assert recommendation.for_real_time(result) is recommendation.for_accuracy(result) is None


def test_damaged_results_and_those_of_other_code_are_not_found(tmp_path, monkeypatch):
    results, key = cache.Cache(tmp_path), {'part': 'x'}
    results.save(key, {'a': 1}, np.arange(3.0))
    result, array = results.load(key)
    assert (result, array.tolist()) == ({'a': 1}, [0.0, 1.0, 2.0])
    (record,), (data,) = tmp_path.glob('*.json'), tmp_path.glob('*.npy')
    for path, damaged in ((record, b'{}'), (record, b''), (record, b'[]'), (data, b'')):
        whole = path.read_bytes()
        path.write_bytes(damaged)
        assert results.load(key) is None
        path.write_bytes(whole)
    assert results.load(key) is not None
    monkeypatch.setattr(cache, '_fingerprint', lambda: 'of other code')
    assert results.load(key) is None
