"""Quaternions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cloth_ros.scene.quaternion import (
    checked_orientation,
    product,
    rotated,
    rotation_matrix,
)

COMPONENTS = st.floats(-1, 1)
QUATERNIONS = st.tuples(*[COMPONENTS] * 4).filter(lambda q: math.hypot(*q) > 1e-3)
VECTORS = st.tuples(*[COMPONENTS] * 3)


@given(first=QUATERNIONS, second=QUATERNIONS, point=VECTORS)
def test_a_product_turns_as_both_one_after_the_other(first, second, point):
    first, second = (checked_orientation('q', each) for each in (first, second))
    both = rotated(product(first, second), point)
    np.testing.assert_allclose(both, rotated(first, rotated(second, point)), atol=1e-12)
    expected = Rotation.from_quat(first).apply(point)
    np.testing.assert_allclose(rotated(first, point), expected, atol=1e-12)
    matrices = rotation_matrix([first, second])
    for found, each in zip(matrices, (first, second), strict=True):
        np.testing.assert_allclose(found, Rotation.from_quat(each).as_matrix(), atol=1e-12)
        assert np.array_equal(found, rotation_matrix(each))


@given(quaternion=QUATERNIONS, exponent=st.floats(-300, 290))
def test_a_quaternion_may_have_any_length(quaternion, exponent):
    scaled = [10.0**exponent * component for component in quaternion]
    unit = checked_orientation('q', scaled)
    assert math.hypot(*unit) == pytest.approx(1.0)
    np.testing.assert_allclose(unit, np.array(quaternion) / math.hypot(*quaternion), atol=1e-12)
    assert checked_orientation('q', unit) == unit  # to the bit, however often it is checked


@pytest.mark.parametrize(
    'value', [(0, 0, 0, 0), (0, 0, 1), (0, 0, 0, math.nan), (math.inf, 0, 0, 1), None, 'xyzw', 1]
)
def test_what_is_no_rotation_is_refused(value):
    with pytest.raises(ValueError, match=r'^the pose is .*, but must be .*; write \[0.0, 0.0'):
        checked_orientation('the pose', value)
