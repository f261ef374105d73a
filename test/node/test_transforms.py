import math

import pytest
from geometry_msgs.msg import Quaternion, Transform, Vector3

from cloth_ros.node.transforms import transformed, transformed_pose


def test_points_are_turned_and_shifted_and_vectors_turned_only():
    quarter = Quaternion(z=math.sqrt(0.5), w=math.sqrt(0.5))
    transform = Transform(translation=Vector3(x=10.0, y=20.0, z=30.0), rotation=quarter)
    point = transformed((1.0, 0.0, 2.0), transform, is_point=True)
    assert point == pytest.approx((10.0, 21.0, 32.0))
    vector = transformed((1.0, 0.0, 2.0), transform, is_point=False)
    assert vector == pytest.approx((0.0, 1.0, 2.0))


def test_a_pose_is_turned_and_shifted():
    quarter = Quaternion(z=math.sqrt(0.5), w=math.sqrt(0.5))
    transform = Transform(translation=Vector3(x=10.0, y=20.0, z=30.0), rotation=quarter)
    half = math.sqrt(0.5)
    position, orientation = transformed_pose((1.0, 0.0, 2.0), (0.0, 0.0, half, half), transform)
    assert position == pytest.approx((10.0, 21.0, 32.0))
    assert orientation == pytest.approx((0.0, 0.0, 1.0, 0.0), abs=1e-12)
