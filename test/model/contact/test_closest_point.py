"""The point of a triangle that is closest to the origin."""

import math

import numpy as np
import pytest
from builders import examples, seeds
from geometry import triangle_distances
from hypothesis import example, given
from hypothesis import strategies as st

from cloth_ros.model.contact import closest_point as subroutines
from cloth_ros.model.kernels.jit import exact

subroutine = subroutines.closest_point


@exact
def closest_point(points, a, b, c):
    """Call the subroutine, which has no interface to Python."""
    return subroutine(points, a, b, c)


@examples(1.5)
@given(seeds, st.floats(0.01, 100), st.floats(1e-6, 1))
@example(0, 1.0, 1e-9)
def test_no_point_of_the_triangle_is_closer(seed, offset, flatness):
    generator = np.random.default_rng(seed)
    corners = generator.normal(size=(3, 3)) * (1, 1, flatness) + generator.normal(size=3) * offset
    squared, *weights = closest_point(corners, 0, 1, 2)
    assert min(weights) >= 0
    assert sum(weights) == pytest.approx(1)
    scale = np.abs(corners).max()
    point = weights @ corners
    assert math.sqrt(squared) == pytest.approx(np.linalg.norm(point), abs=1e-9 * scale)
    # Convexity: no corner is nearer in the direction of the closest point.
    assert (corners @ point).min() >= squared - 1e-7 * scale * scale
    (distance,) = triangle_distances(corners[None], (0, 0, 0))
    assert distance == pytest.approx(math.sqrt(squared), abs=1e-6 * scale)


def test_degenerate_triangles_are_segments_and_points():
    points = np.array([[1.0, 1, 0], [1, -1, 0], [3, 0, 0]])
    assert closest_point(points, 0, 1, 1) == (1.0, 0.5, 0.5, 0.0)
    assert closest_point(points, 2, 2, 2) == (9.0, 1.0, 0.0, 0.0)
    line = np.array([[1.0, 1, 0], [1, -1, 0], [1, 0.5, 0]])
    assert closest_point(line, 0, 1, 2)[0] == 1.0
