"""Pins and colliders that are read from the markers of real nodes."""

import numpy as np
import pytest
from ros import NODE, ROOT

from cloth_ros import Scene
from cloth_ros.viewer.marker_shapes import MarkerShapes


@pytest.mark.parametrize(
    ('scene', 'kinds'),
    [
        ('table', {'table': ['box'], 'leg': ['cylinder'], 'floor': ['box']}),
        ('robot_arm', {'column': ['cylinder'], 'hand': ['cylinder', 'sphere', 'sphere']}),
    ],
)
def test_colliders_are_at_the_poses_of_the_scene(start, probe, scene, kinds):
    path = f'config/{scene}.yaml'
    start(*NODE, '--ros-args', '--params-file', path)
    markers = MarkerShapes(probe, '/cloth/markers')
    markers.request()
    taken = []
    probe.spin_until(lambda: taken.append(markers.take()) or taken[-1])
    assert not markers.waiting
    shapes = taken[-1]
    expected = Scene.from_yaml(ROOT / path)
    assert len(shapes.pins) == expected.pinned().sum()
    assert shapes.colliders.keys() == {each.name for each in expected.all_colliders()}
    for collider in expected.all_colliders():
        pose, _ = shapes.colliders[collider.name]
        np.testing.assert_allclose(pose.position, collider.position, atol=1e-6)
        w, x, y, z = pose.wxyz
        np.testing.assert_allclose((x, y, z, w), collider.orientation, atol=1e-6)
    for name, kind in kinds.items():
        parts = shapes.colliders[name][1]
        assert [part.kind for part in parts] == kind
        assert parts[0].is_plane == (name == 'floor')
