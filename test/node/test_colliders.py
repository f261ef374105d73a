"""Colliders of a running node: their parameters and topics, which come and go."""

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from node.conftest import SteppedCloth, at_rest
from rcl_interfaces.srv import DescribeParameters, ListParameters, SetParameters
from ros import diagnosis, parameter_request, pose, publish_until
from visualization_msgs.msg import Marker, MarkerArray

from cloth_ros.scene.parameter import MEMBERS

# A ball out of reach of the sheet, which floats at z = 1.
BALL = {
    'collider.ball.type': 'sphere',
    'collider.ball.radius': 0.1,
    'collider.ball.position': [0.0, 0.0, 2.0],
}
NAMED = {**BALL, 'collider.names': ['ball']}


@pytest.fixture
def node(cloth: SteppedCloth) -> Iterator[SteppedCloth]:
    """The stepped node without colliders but the sphere; it has none afterwards either."""
    yield cloth
    cloth.remove_colliders('ball')


def declared(node: SteppedCloth, prefix: str = 'collider') -> set[str]:
    """Return the names of the parameters below a prefix."""
    request = ListParameters.Request(prefixes=[prefix])
    answer = node.probe.call(ListParameters, '/cloth/list_parameters', request)
    return set(answer.result.names)


def listeners(node: SteppedCloth, name: str) -> int:
    return node.probe.count_subscribers(f'/{name}/pose')


def marker(markers: list[MarkerArray], name: str) -> Marker | None:
    """Return the newest marker of a collider."""
    found = [each for array in markers for each in array.markers if each.ns == name]
    return found[-1] if found and found[-1].action == Marker.ADD else None


def test_a_collider_is_added_parameter_by_parameter_moved_and_removed(node):
    markers = node.probe.collect(MarkerArray, '/cloth/markers')
    for name, value in BALL.items():
        (reason,) = node.set(**{name: value})
        assert reason == "no effect until 'ball' is in collider.names"
        assert listeners(node, 'ball') == 0
    assert declared(node) == {
        'collider.names',
        *(f'collider.ball.{f}' for f in MEMBERS['collider']),
    }
    assert node.set(collider__names=['ball']) == ['']
    node.probe.spin_until(lambda: listeners(node, 'ball') == 1)
    node.tick_until(lambda _: marker(markers, 'ball'))
    shown = marker(markers, 'ball')
    assert (shown.pose.position.z, shown.scale.x) == (2.0, 0.2)
    assert at_rest(node.tick()[-1])

    publisher = node.probe.publisher(PoseStamped, '/ball/pose')
    command = pose(x=0.1, z=1.02)
    command.pose.orientation.z, command.pose.orientation.w = 3.0, 4.0  # of length 5
    publisher.publish(command)
    node.tick_until(lambda state: not at_rest(state))
    markers.clear()
    node.tick_until(lambda _: marker(markers, 'ball'))
    shown = marker(markers, 'ball').pose
    assert (shown.position.x, shown.position.z) == (0.1, 1.02)
    assert (shown.orientation.z, shown.orientation.w) == pytest.approx((0.6, 0.8))

    assert node.set(collider__names=['']) == ['']
    node.probe.spin_until(lambda: listeners(node, 'ball') == 0)
    node.tick_until(lambda _: marker(markers, 'ball') is None)
    assert declared(node) == {'collider.names'}
    node.process.wait_for_output('no longer listening to /ball/pose')


def test_the_order_of_parameters_in_one_request_does_not_matter(node):
    """As `ros2 param load` sends them, in the order of a file."""
    for order in (1, -1):
        values = dict(list(NAMED.items())[::order])
        request = parameter_request(values)
        results = node.probe.call(SetParameters, '/cloth/set_parameters', request).results
        assert [each.successful for each in results] == [True] * len(values)
        node.probe.spin_until(lambda: listeners(node, 'ball') == 1)
        assert node.set_together({'collider.names': ['']}) == ''
        node.probe.spin_until(lambda: listeners(node, 'ball') == 0)
    assert node.set_together(NAMED) == ''
    kind = DescribeParameters.Request(names=['collider.ball.radius'])
    (found,) = node.probe.call(DescribeParameters, '/cloth/describe_parameters', kind).descriptors
    assert '[m]' in found.description
    assert found.floating_point_range[0].to_value == 1e3


REJECTED = [
    ({'collider.names': ['cube']}, "collider.cube.type is not given, but must be one of 'plane'"),
    ({'collider.names': ['ball', 'wind']}, 'that exists; write "wind_2"'),
    ({'collider.names': ['ball', 'ball']}, 'not used twice'),
    ({'collider.names': ['ball', 'sphere']}, 'as sphere.radius'),
    ({'collider.ball.type': 'box'}, 'collider.ball.size is [0.0, 0.0, 0.0], but must be 0.0001'),
    ({'collider.ball.type': 'ballon'}, "collider.ball.type is 'ballon', but must be one of"),
    ({'collider.ball.radius': 0.0}, 'collider.ball.radius is 0.0, but must be 0.0001 to 1000 m'),
    ({'collider.ball.orientation': [0.0] * 4}, 'a quaternion other than zero; write [0.0, 0.0'),
    ({'collider.ball.position': [0.0, math.nan, 0.0]}, 'finite'),
    ({'collider.ball.radios': 0.1}, "did you mean 'collider.ball.radius'?"),
    ({'collider.other.radios': 0.1}, "did you mean 'collider.other.radius'?"),
    ({'collider.2nd.radius': 0.1}, "the name of a collider is '2nd'"),
]


def test_what_is_wrong_is_rejected_and_changes_nothing(node):
    assert node.set_together(NAMED) == ''
    before = declared(node)
    for changes, part in REJECTED:
        for set_values in (node.set_together, lambda values: node.set(**values)[0]):
            assert part in set_values(changes)
    assert declared(node) == before
    node.probe.spin_until(lambda: listeners(node, 'ball') == 1)
    assert at_rest(node.tick()[-1])


def rejected(node: SteppedCloth) -> list[int]:
    """Return how many poses of the ball and of the sphere were rejected."""
    found = diagnosis(node.probe)
    return [int(found[f'rejected messages on {topic}']) for topic in ('ball/pose', 'sphere_pose')]


def test_poses_that_are_not_valid_are_rejected_with_one_line_and_counted(node):
    assert node.set_together(NAMED) == ''
    publisher = node.probe.publisher(PoseStamped, '/ball/pose')
    sphere = node.probe.publisher(PoseStamped, '/sphere_pose')
    zero, infinite = pose(z=1.5), pose(z=1.5)
    zero.pose.orientation.w, infinite.pose.orientation.x = 0.0, math.inf
    before = rejected(node)
    for message in (zero, infinite, pose(x=math.nan), pose(z=1e5), pose(frame='moon')):
        publisher.publish(message)
    sphere.publish(zero)
    node.probe.spin_until(lambda: rejected(node) == [before[0] + 5, before[1] + 1])
    text = 'the orientation is [0.0, 0.0, 0.0, 0.0], but must be a quaternion other than zero'
    publish_until(  # again and again: warnings are throttled
        lambda: f'rejected a message on ball/pose: {text}' in node.process.output,
        node.probe,
        publisher,
        itertools.repeat(zero),
    )
    assert at_rest(node.tick(2)[-1])


def test_a_type_changes_while_running(node):
    assert node.set_together(NAMED) == ''
    # What the present type does not have is kept for the next one.
    assert node.set(collider__ball__size=[0.1, 0.2, 0.3]) == ['']
    node.process.wait_for_output(
        'collider.ball.size is [0.1, 0.2, 0.3]: it has no effect on a sphe'
    )
    assert node.set(collider__ball__type='box') == ['']
    assert at_rest(node.tick()[-1])


def test_parameters_of_a_collider_are_set_by_text(node):
    """As `ros2 param set` sends numbers and lists that mix integers and floats."""
    texts = {
        'collider.ball.type': 'sphere',
        'collider.ball.radius': '1e-1',
        'collider.ball.position': '[0, 0, 2.5]',
        'collider.names': '[]',
    }
    for name, text in texts.items():
        (reason,) = node.set(**{name: text})
        assert 'but must be' not in reason
    assert np.isfinite(node.tick()[-1]).all()


def test_a_node_is_started_with_colliders(start_cloth, probe, tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text(
        '/**:\n  ros__parameters:\n    collider:\n      names: [ball, y]\n'
        '      ball: {type: sphere, radius: 0.1, position: [0, 0, 3.5]}\n'
        '      y: {type: sphere, radius: 0.2, position: [0, 0, 5], size: [1, 1, 1]}\n'
        '      spare: {type: box}\n'
    )
    node = start_cloth('--params-file', str(path), collider__ball__friction=0.5)
    assert 'listening to /wind, /sphere_pose, /ball/pose and /y/pose' in node.output
    assert 'collider.y.size is [1, 1, 1]: it has no effect on a sphere' in node.output
    assert "collider 'spare' have no effect" in node.output
    assert 'write collider.names: ["ball", "y", "spare"]' in node.output
    markers = probe.collect(MarkerArray, '/cloth/markers')
    probe.spin_until(lambda: marker(markers, 'ball') and marker(markers, 'y'))
    assert marker(markers, 'y').scale.x == pytest.approx(0.4)
    found = diagnosis(probe)
    assert found['rejected messages on y/pose'] == '0'
