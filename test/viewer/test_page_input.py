"""Numbers that a page sends are checked and limited before they reach a topic or a parameter."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.viewer.cloth_client import MAX_WIND
from cloth_ros.viewer.discovery import ClothName
from cloth_ros.viewer.parameter_slider import Range
from cloth_ros.viewer.pose import FARTHEST, commanded_pose
from cloth_ros.viewer.wind_controls import wind_angles, wind_velocity

ANY = st.floats(allow_nan=True, allow_infinity=True)


@given(st.tuples(ANY, ANY, ANY))
def test_wind_is_finite_and_limited(numbers):
    velocity = wind_velocity(*numbers)
    if not np.isfinite(numbers).all():
        assert velocity is None
    else:
        assert math.hypot(*velocity) <= MAX_WIND * (1 + 1e-9)


@given(st.floats(0.1, MAX_WIND), st.floats(-179, 179), st.floats(-89, 89))
def test_angles_are_those_of_the_wind(speed, azimuth, elevation):
    expected = speed, azimuth, elevation
    np.testing.assert_allclose(wind_angles(wind_velocity(*expected)), expected, atol=1e-6)


@given(st.tuples(ANY, ANY, ANY), st.tuples(ANY, ANY, ANY, ANY))
def test_poses_are_finite_near_and_of_unit_length(position, wxyz):
    pose = commanded_pose(position, wxyz)
    if pose is not None:
        assert np.abs(pose.position).max() <= FARTHEST
        assert math.hypot(*pose.wxyz) == pytest.approx(1.0)


@given(ANY, st.booleans())
def test_parameters_stay_in_the_range_of_their_slider(position, logarithmic):
    offered = Range('solver.tolerance', 'tolerance', 1e-5, 0.1, logarithmic)
    value = offered.to_value(position)
    assert value is None if not math.isfinite(position) else 1e-5 <= value <= 0.1


def test_a_slider_returns_the_value_that_it_shows():
    offered = Range('solver.tolerance', 'tolerance', 1e-5, 0.1, logarithmic=True)
    assert offered.to_value(offered.to_slider(2e-4)) == 2e-4


@pytest.mark.parametrize(('node', 'wind'), [('/cloth', '/wind'), ('/lab/a/cloth', '/lab/a/wind')])
def test_topics_are_those_of_the_namespace(node, wind):
    name = ClothName(node)
    assert name.resolve('wind') == wind
    assert name.resolve('~/particles') == f'{node}/particles'
    assert name.resolve('/diagnostics') == '/diagnostics'
