"""What a node publishes about its colliders."""

import math
import sys

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, WrenchStamped
from node.conftest import running
from ros import diagnosis, pose, publish_until
from visualization_msgs.msg import Marker, MarkerArray

from cloth_ros import Scene

TABLE, ARM = 'config/table.yaml', 'config/robot_arm.yaml'


@pytest.fixture(scope='module')
def table():
    with running('--params-file', TABLE) as (_, probe):
        yield probe


def newest(arrays: list[MarkerArray], name: str) -> list[Marker]:
    """Return the markers of a collider in the newest message; none from one that deletes."""
    return [each for each in arrays[-1].markers if each.ns == name] if arrays else []


def mean_force(wrenches: list[WrenchStamped], count: int = 120) -> np.ndarray:
    """Return the mean of the newest forces, N, shape (3,); NaN until there are so many."""
    forces = [each.wrench.force for each in wrenches[-count:]]
    if len(forces) < count:
        return np.full(3, np.nan)
    return np.mean([(force.x, force.y, force.z) for force in forces], axis=0)


def test_table_leg_and_floor_are_drawn(table):
    arrays = table.collect(MarkerArray, '/cloth/markers')
    table.spin_until(lambda: newest(arrays, 'table'))
    kinds = {each.ns: each.type for each in arrays[-1].markers}
    assert kinds == {
        'sheet': Marker.TRIANGLE_LIST,
        'wind': Marker.ARROW,
        'table': Marker.CUBE,
        'leg': Marker.CYLINDER,
        'floor': Marker.CUBE,
    }
    (leg,) = newest(arrays, 'leg')
    assert leg.pose.position.z == 0.23
    assert leg.scale.x == pytest.approx(0.1)


def test_table_and_floor_carry_the_sheet(table):
    weight = 9.81 * Scene.from_yaml(TABLE).sheet.mass
    on = {
        name: table.collect(WrenchStamped, f'/{name}/wrench', 1000) for name in ('table', 'floor')
    }

    def carried() -> bool:
        total = mean_force(on['table']) + mean_force(on['floor'])
        return np.allclose(total, [0.0, 0.0, -weight], atol=0.05 * weight)

    table.spin_until(carried)
    assert mean_force(on['table'])[2] < -0.3 * weight


def test_diagnostics_count_the_particles_that_touch(table):
    found: dict[str, str] = {}

    def lies() -> bool:
        found.update(diagnosis(table))
        return int(found['table touching particles']) > 20

    table.spin_until(lies)
    for name in ('table', 'leg', 'floor'):
        assert 0 <= float(found[f'{name} penetration [m]']) < 0.01


def test_the_marker_follows_the_pose(table):
    """The last test of this node: the table stays where it is moved."""
    arrays = table.collect(MarkerArray, '/cloth/markers')
    publisher = table.publisher(PoseStamped, '/table/pose')

    def moved() -> bool:
        return any(abs(each.pose.position.z - 0.5) < 1e-9 for each in newest(arrays, 'table'))

    publish_until(moved, table, publisher, iter(lambda: pose(z=0.5), None))


@pytest.mark.slow
def test_the_example_sweeps_the_arm_through_the_curtain(start_cloth, start, probe):
    # Few markers: to read 30 arrays of triangles per second is too much for a probe in Python.
    start_cloth('--params-file', ARM, markers__rate=5.0)
    arrays = probe.collect(MarkerArray, '/cloth/markers')
    wrenches = probe.collect(WrenchStamped, '/hand/wrench', 1000)
    probe.spin_until(lambda: wrenches and newest(arrays, 'hand'))  # discovered by the node
    example = start(sys.executable, 'examples/robot_arm.py')

    def reached(y: float) -> bool:
        """Return True if all of the hand has been beyond some y, m."""
        parts = [[each.pose.position.y for each in newest([array], 'hand')] for array in arrays]
        return max(map(min, filter(None, parts)), default=-math.inf) > y

    def pushed() -> bool:
        """Return True if the cloth has pushed the hand back."""
        return any(each.wrench.force.y < -0.02 for each in wrenches)

    probe.spin_until(lambda: reached(-0.4))  # until then, kernels may have to be compiled
    probe.spin_until(lambda: reached(0.02) and pushed())
    assert example.stop() == 0, example.output
    assert 'Traceback' not in example.output
