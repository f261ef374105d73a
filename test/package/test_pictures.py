"""Pictures of the README: captured from a running node, one or more of each scene."""

import numpy as np
import pytest
from builders import ROOT, SCENE_FILES

from cloth_ros import Cloth, Scene
from tools.pictures.capture import RATE, capture
from tools.pictures.moments import ANIMATION, MOMENTS, MOTIONS, of_scene


def test_every_scene_has_pictures_of_its_own():
    pictures = [moment.picture for path in SCENE_FILES for moment in of_scene(path)]
    assert len(set(pictures)) == len(pictures)
    assert {*MOMENTS, *MOTIONS, ANIMATION.scene} <= {path.stem for path in SCENE_FILES}


def test_a_capture_has_the_states_of_its_times():
    path = ROOT / 'config' / 'hanging.yaml'
    frames = capture(path, [0.1, 0.25])
    cloth, states = Cloth(Scene.from_yaml(path)), []
    for _ in range(15):
        cloth.advance(1 / RATE)
        states.append(cloth.positions)
    for frame, state in zip(frames, (states[5], states[14]), strict=True):
        np.testing.assert_allclose(frame.positions, state, atol=1e-5)
        (pins,) = frame.markers
        corners = [(each.x, each.y, each.z) for each in pins.points]
        np.testing.assert_allclose(corners, state[0, [0, -1]], atol=1e-6)


def test_colliders_are_moved_before_a_capture():
    path = ROOT / 'config' / 'small_fast_sphere.yaml'
    (frame,) = capture(path, [0.2], MOTIONS['small_fast_sphere'])
    (sphere,) = [each for each in frame.markers if each.ns == 'sphere']
    assert sphere.pose.position.z == pytest.approx(0.6)
    rows, columns, _ = frame.positions.shape
    assert frame.positions[rows // 2, columns // 2, 2] < 0.7  # pushed down from 1 m
