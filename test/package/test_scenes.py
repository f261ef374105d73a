"""The scenes in config/, and the example that moves an arm."""

import numpy as np
import pytest
from builders import ROOT, SCENE_FILES
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.scene.quaternion import rotation_matrix
from examples.robot_arm import LINKS, PERIOD, SHOULDER, link_poses


@pytest.mark.parametrize('path', SCENE_FILES, ids=lambda path: path.stem)
def test_no_collider_of_a_scene_is_placed_inside_the_sheet(path):
    cloth = Cloth(Scene.from_yaml(path))
    assert [each.name for each in cloth.scene.all_colliders()] == list(cloth.colliders)
    assert {name: each.inset for name, each in cloth.colliders.items()} == dict.fromkeys(
        cloth.colliders, 0.0
    )


def ends(seconds: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return both joints of each link, m, from the poses alone."""
    joints = {}
    for name, (centre, quaternion) in link_poses(seconds).items():
        assert np.linalg.norm(quaternion) == pytest.approx(1.0)
        half = rotation_matrix(quaternion) @ (0.0, 0.0, LINKS[name] / 2)
        joints[name] = (centre - half, centre + half)
    return joints


@given(seconds=st.floats(0, 1000))
def test_the_links_of_the_arm_stay_joined(seconds):
    joint = SHOULDER
    for start, end in ends(seconds).values():
        assert start == pytest.approx(joint, abs=1e-9)
        joint = end


def test_the_arm_starts_in_the_pose_of_its_scene():
    scene = Scene.from_yaml(ROOT / 'config' / 'robot_arm.yaml')
    colliders = {each.name: each for each in scene.colliders}
    for name, (position, quaternion) in link_poses(0.0).items():
        its = colliders[name]
        assert (its.type, its.length) == ('capsule', LINKS[name])
        assert its.position == pytest.approx(position, abs=1e-6)
        assert its.orientation == pytest.approx(quaternion, abs=1e-6)


def test_the_hand_goes_through_the_curtain_and_back_out():
    hand = np.array([ends(share * PERIOD)['hand'][1] for share in np.linspace(0, 1, 81)])
    through = hand[hand[:, 1] > 0.1]  # m, beyond the curtain at y = 0
    assert np.ptp(through[:, 0]) > 0.3
    assert np.abs(through[:, 0]).max() < 0.6  # within its width
    assert hand[0, 1] < -0.3
    assert hand[-1] == pytest.approx(hand[0])
