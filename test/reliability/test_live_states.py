"""What subscribers see of a violent scene: nothing that is not finite, no sphere in the cloth."""

import math
import time

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry import ray_crossings, triangle_distances
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from reliability.live_node import live_node
from ros import pose, wind
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

# Live nodes beside faults take minutes, and are no news after each small change.
pytestmark = pytest.mark.slow

# A soft and heavy sheet between two rows of pins, which a sphere stretches far in one tick.
VIOLENT = {
    'sheet.rows': 3,
    'sheet.columns': 4,
    'sheet.mass': 7.0,
    'pins': "[':,0', ':,-1']",
    'springs.structural': 9.0,
    'springs.shear': 140.0,
    'springs.bending': 6.0,
    'drag': 0.0,
    'wind.air_density': 0.1,
    'sphere.radius': 0.1,
    'sphere.position': '[0.0, 0.0, 1.6]',
    'sphere.friction': 1.0,
}


def test_storm(measured):
    """A storm and a sphere that jumps: roll-backs are a warning, all that is published finite."""
    parameters = [f'{name}:={value}' for name, value in VIOLENT.items()]
    with live_node(*(part for each in parameters for part in ('-p', each)), timed=False) as node:
        listener = node.listener
        blow = listener.publisher(Vector3Stamped, '/wind')
        move = listener.publisher(PoseStamped, '/sphere_pose')

        def warnings() -> list:
            for sign, height in ((1.0, 1.0), (-1.0, 0.1)):
                blow.publish(wind(y=1e3 * sign))
                move.publish(pose(z=height))
                listener.spin_for(0.3)
            return [each for each in listener.reports if 'unexplained energy' in each.message]

        listener.spin_until(warnings)
        report = warnings()[0]
        assert report.level == DiagnosticStatus.WARN
        assert int(report.values['substep batches refined']) > 0
        assert math.isfinite(float(report.values['energy [J]']))
        blow.publish(wind())
        node.recover()
        measured(f'{len(listener.particles)} messages; {report.message}')
        node.check()


RADIUS = 0.0096774  # m, 0.3 times the spacing; of config/small_fast_sphere.yaml
TOP, BOTTOM = 1.5, 0.5  # m


def decode(message: MarkerArray) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles of the sheet, shape (n, 3, 3), and the centre of the sphere."""
    by_name = {marker.ns: marker for marker in message.markers}
    points = np.array([(point.x, point.y, point.z) for point in by_name['sheet'].points])
    centre = by_name['sphere'].pose.position
    return points.reshape(-1, 3, 3), np.array((centre.x, centre.y, centre.z))


def test_small_sphere_through_the_middle(long, measured):
    """A small sphere commanded through the cloth at 1 to 100 m/s: at most 1 mm deep in it."""
    with live_node('--params-file', 'config/small_fast_sphere.yaml', timed=False) as node:
        listener, gaps = node.listener, []
        messages = listener.collect(MarkerArray, '/cloth/markers', depth=500)
        move = listener.publisher(PoseStamped, '/sphere_pose')
        listener.spin_until(lambda: len(messages) > 1)  # the first one deletes all markers
        for speed in (1.0, 5.0, 20.0, 100.0) if long else (5.0, 100.0):
            listener.call(Trigger, '/cloth/reset', Trigger.Request())
            messages.clear()
            move.publish(pose(z=TOP))
            listener.spin_until(lambda: messages and decode(messages[-1])[1][2] == TOP)
            began, z = time.monotonic(), TOP
            while z > BOTTOM:
                z = max(TOP - speed * (time.monotonic() - began), BOTTOM)
                move.publish(pose(z=z))
                listener.spin_for(1 / 120)
            listener.spin_until(lambda: decode(messages[-1])[1][2] == BOTTOM)
            listener.spin_for(0.5)
            gaps += [triangle_distances(*decode(message)).min() - RADIUS for message in messages]
            triangles, centre = decode(messages[-1])
            # The sheet, which is held at z = 1, hangs below the sphere.
            assert triangles[..., 2].min() < BOTTOM
            assert ray_crossings(triangles, centre, (1e-5, 2e-5, -1)) % 2 == 1
            assert ray_crossings(triangles, centre, (1e-5, 2e-5, 1)) % 2 == 0
        measured(f'least gap {1e3 * min(gaps):.2g} mm in {len(gaps)} messages')
        assert min(gaps) > -1e-3  # of what is published; the model itself keeps 0.1 mm
        node.check()
