"""The small sphere on the running node, as its subscribers see it."""

import time

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from reference import crossings, distances
from ros import pose
from visualization_msgs.msg import MarkerArray

RADIUS = 0.0096774  # m, 0.3 times the spacing; of config/small_fast_sphere.yaml
TOP, BOTTOM = 1.5, 0.5


def state(message: MarkerArray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the sheet, shape (n, 3, 3), and centre of the sphere in one message."""
    by_name = {marker.ns: marker for marker in message.markers}
    points = np.array([(point.x, point.y, point.z) for point in by_name['sheet'].points])
    centre = by_name['sphere'].pose.position
    return points.reshape(-1, 3, 3), np.array((centre.x, centre.y, centre.z))


@pytest.mark.parametrize('speed', [1.0, 5.0, 20.0, 100.0])
def test_the_small_sphere_commanded_through_the_middle_does_not_pass(start_cloth, probe, speed):
    start_cloth('--params-file', 'config/small_fast_sphere.yaml', markers__rate=60.0)
    messages = probe.collect(MarkerArray, '/cloth/markers', depth=500)
    move = probe.publisher(PoseStamped, '/sphere_pose')
    probe.spin_until(lambda: messages)
    began, z = time.monotonic(), TOP
    while z > BOTTOM:
        z = max(TOP - speed * (time.monotonic() - began), BOTTOM)
        move.publish(pose(z=z))
        probe.spin_for(1 / 120)
    probe.spin_until(lambda: state(messages[-1])[1][2] == BOTTOM)
    probe.spin_for(1.0)
    gaps = [distances(*state(message)).min() - RADIUS for message in messages]
    assert min(gaps) > -1e-3  # the promise; the model itself keeps 0.1 mm
    triangles, centre = state(messages[-1])
    assert centre[2] == BOTTOM
    # The sheet, held at z = 1, hangs below the sphere.
    assert triangles[..., 2].min() < BOTTOM
    assert crossings(triangles, centre, (1e-5, 2e-5, -1)) % 2 == 1
    assert crossings(triangles, centre, (1e-5, 2e-5, 1)) % 2 == 0
