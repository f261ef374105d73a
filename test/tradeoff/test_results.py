"""What is made of results: validity of the reference, cache."""

import numpy as np

from cloth_ros.tradeoff import cache
from cloth_ros.tradeoff.reference_solution import horizon, time_together


def test_the_horizon_ends_where_the_levels_of_the_reference_diverge():
    between = np.array([1e-12, 1e-6, 1e-5, 1e-2, 1e-6])
    error = np.array([1e-9, 1e-4, 1e-3, 1e-2, 1e-2])
    found = horizon(between, [error, 10 * error])
    assert (found.samples, found.agreement, found.smallest_error) == (3, 1e-5, 1e-3)
    assert horizon(between, [0 * error]).samples == 1
    times = np.array([0.1, 0.2, 0.3])
    for apart, expected in (([0.0, 0.02, 0.0], 0.2), ([0.0, 0.0, 0.0], 0.3), ([], 0.0)):
        assert time_together(np.array(apart), times, 1.0) == expected


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
