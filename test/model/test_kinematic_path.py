"""The path of a collider in one advance: waypoints that are left out of a long one."""

import numpy as np
import pytest
from builders import examples
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.kinematic_path import MAX_WAYPOINTS, extend_path

START = (0.0, 0.0, 0.0)


def thinned(points: np.ndarray) -> np.ndarray:
    """Return the path to points that are commanded one by one, without its start."""
    path: tuple = ()
    for point in points.tolist():
        path = extend_path(START, path, tuple(point))
    return np.array(path)


def pieces(points: np.ndarray) -> np.ndarray:
    """Return the lengths of the pieces of a path from the start."""
    return np.linalg.norm(np.diff([START, *points], axis=0), axis=1)


@examples(0.25)
@given(
    steps=st.lists(
        st.sampled_from([0.0, 1e-3, 1.0, 20.0]) | st.floats(0, 1), min_size=1, max_size=300
    ),
    turn=st.sampled_from([0.0, 0.05, 1.0, np.pi]),
)
def test_a_long_path_is_thinned_evenly(steps, turn):
    angles = turn * np.arange(len(steps))
    directions = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    points = np.cumsum(np.array(steps)[:, None] * directions, axis=0)
    kept = thinned(points)
    assert len(kept) == min(len(points), MAX_WAYPOINTS)
    assert kept[-1].tolist() == points[-1].tolist()
    commanded = iter(points.tolist())
    assert all(point in commanded for point in kept.tolist())  # in their order
    whole = pieces(points)
    for gap in pieces(kept):
        assert gap <= whole.sum() / 32 * (1 + 1e-9) or np.isclose(gap, whole).any()


@pytest.mark.parametrize('count', [65, 100, 1000, 5000])
def test_a_circle_remains_round(count):
    """Within 1 % of the radius; pieces, but for the last, differ by a factor of 4 at most."""
    angles = 2 * np.pi * np.arange(1, count + 1) / count
    kept = thinned(np.stack([1 - np.cos(angles), np.sin(angles), 0 * angles], axis=1))
    chords = pieces(kept)
    assert chords[:-1].max() <= 4 * chords[:-1].min()
    middles = (np.array([START, *kept[:-1]]) + kept) / 2
    assert np.linalg.norm(middles - [1.0, 0.0, 0.0], axis=1).min() > 0.99
