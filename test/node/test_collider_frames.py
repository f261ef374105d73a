"""
Colliders that follow frames of tf2.

tf2 is not on PyPI: where it is not installed, only the tests of what the node says then are run.
"""

import importlib.util
import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped
from node.conftest import PERIOD, SteppedCloth, at_rest
from rclpy.duration import Duration
from ros import diagnosis, pose, publish_until
from visualization_msgs.msg import Marker, MarkerArray

HAS_TF2 = importlib.util.find_spec('tf2_ros') is not None
with_tf2 = pytest.mark.skipif(not HAS_TF2, reason='tf2_ros is not installed')
without_tf2 = pytest.mark.skipif(HAS_TF2, reason='tf2_ros is installed')

# A ball beside the sheet, one metre from the origin of a frame.
BALL = {
    'collider.names': ['ball'],
    'collider.ball.type': 'sphere',
    'collider.ball.radius': 0.1,
    'collider.ball.position': [1.0, 0.0, 0.0],
    'collider.ball.frame_id': 'hand',
    'markers.rate': 1000.0,
}


class Ball:
    """The stepped node with a ball that follows a frame, and what its markers show."""

    def __init__(self, node: SteppedCloth) -> None:
        self.node = node
        self._markers: list[MarkerArray] = []
        self._subscription = node.probe.create_subscription(
            MarkerArray, '/cloth/markers', self._markers.append, 100
        )
        node.tick_until(lambda _: self._markers)
        if HAS_TF2:
            from tf2_ros import TransformBroadcaster

            self._broadcaster = TransformBroadcaster(node.probe)
            publisher = self._broadcaster.pub_tf
            node.probe.spin_until(publisher.get_subscription_count)

    def close(self) -> None:
        self.node.probe.destroy_subscription(self._subscription)
        if HAS_TF2:
            self.node.probe.destroy_publisher(self._broadcaster.pub_tf)

    def place_frame(self, x: float, *, ticks: float = 1, angle: float = 0.0) -> None:
        """Publish where the frame is after so many ticks: (x, 5, 0) m, turned about z."""
        message = TransformStamped(child_frame_id='hand')
        message.header.frame_id = 'world'
        stamp = self.node.now + round(1e9 * PERIOD * ticks)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        message.transform.translation.x, message.transform.translation.y = x, 5.0
        message.transform.rotation.z = math.sin(angle / 2)
        message.transform.rotation.w = math.cos(angle / 2)
        self._broadcaster.sendTransform(message)
        assert self._broadcaster.pub_tf.wait_for_all_acked(Duration(seconds=60))

    def tick(self, count: int = 1) -> Marker | None:
        """Tick, and return the marker of the ball; None: there is none."""
        self._markers.clear()
        self.node.tick(count)
        self.node.probe.spin_until(lambda: self._markers)
        shown = [each for each in self._markers[-1].markers if each.ns == 'ball']
        return shown[0] if shown and shown[0].action == Marker.ADD else None

    def appear(self) -> Marker:
        """Tick until there is a ball, whose kernels may have to be compiled first."""
        while (shown := self.tick()) is None:
            pass
        return shown

    def follow(self, x: float) -> Marker:
        """Place the frame and tick until the ball is there."""
        while True:
            self.place_frame(x)
            shown = self.tick()
            if shown is not None and abs(shown.pose.position.x - x - 1.0) < 1e-6:
                return shown


@pytest.fixture
def ball(cloth: SteppedCloth) -> Iterator[Ball]:
    cloth.jump(100.0)  # no transform of the test before is known at this time
    ball = Ball(cloth)
    assert cloth.set_together(BALL) == ''
    yield ball
    ball.close()
    cloth.remove_colliders('ball')


@without_tf2
def test_without_tf2_the_node_says_once_what_to_install(ball):
    assert ball.tick(3) is None
    text = (
        "the collider 'ball' is not there yet: the frame is 'hand', but must be 'world' or empty"
    )
    assert ball.node.process.output.count(text) == 1
    assert 'install ros-jazzy-tf2-ros' in ball.node.process.output
    found = diagnosis(ball.node.probe)
    assert found['message'].startswith(text)
    assert found['level'] == b'\x01'
    assert 'where tf2 is not installed' in found['collider ball follows']
    publisher = ball.node.probe.publisher(PoseStamped, '/ball/pose')
    text = (
        "rejected a message on ball/pose: 'ball' follows the frame 'hand'; set "
        'collider.ball.frame_id to "" to move it by this topic'
    )
    publish_until(  # again and again: warnings are throttled
        lambda: text in ball.node.process.output,
        ball.node.probe,
        publisher,
        itertools.repeat(pose(z=2.0)),
    )
    assert ball.node.set(collider__ball__frame_id='') == ['']
    shown = ball.appear()
    assert (shown.pose.position.x, shown.pose.position.y) == (1.0, 0.0)
    assert 'collider ball follows' not in diagnosis(ball.node.probe)


def test_the_frame_of_the_scene_is_no_frame_to_follow(ball):
    assert ball.node.set(collider__ball__frame_id='world') == ['']
    assert ball.appear().pose.position.x == 1.0


@with_tf2
def test_a_collider_is_where_its_frame_is_at_the_time_of_each_tick(ball):
    assert ball.tick(3) is None
    assert "the collider 'ball' is not there yet" in diagnosis(ball.node.probe)['message']
    quarter = math.pi / 2
    ball.place_frame(0.0, angle=quarter)
    shown = ball.tick()
    if shown is None:  # the kernels of contact have been loaded meanwhile
        ball.node.probe.spin_for(0.5)
        ball.place_frame(0.0, angle=quarter)
        shown = ball.tick()
    place = shown.pose.position
    np.testing.assert_allclose([place.x, place.y, place.z], [0.0, 6.0, 0.0], atol=1e-9)
    assert shown.pose.orientation.z == pytest.approx(math.sqrt(0.5))
    # Between two transforms, interpolated; the frame is turned back meanwhile.
    ball.place_frame(0.0)
    ball.tick()
    for start in (0.0, 0.4, 0.8):
        ball.place_frame(start + 0.4, ticks=4)
        for n in (1, 2, 3, 4):
            shown = ball.tick()
            assert shown.pose.position.x == pytest.approx(1.0 + start + 0.1 * n, abs=1e-6)
    assert at_rest(ball.node.tick()[-1])
    assert ball.node.process.output.count("the collider 'ball' follows 'hand'")


@with_tf2
def test_without_a_recent_transform_a_collider_stays_where_it_is(ball):
    ball.follow(0.3)
    shown = ball.tick(20)  # of 0.02 s: the latest transform stands for the present one
    assert shown.pose.position.x == pytest.approx(1.3, abs=1e-6)
    assert 'stays where it is' not in diagnosis(ball.node.probe)['message']
    assert ball.tick(10).pose.position.x == pytest.approx(1.3, abs=1e-6)
    found = diagnosis(ball.node.probe)
    assert (
        "the collider 'ball' stays where it is: the latest transform from 'hand'"
        in (found['message'])
    )
    assert 'more than 0.5 s older' in found['collider ball follows']
    ball.follow(0.5)
    assert diagnosis(ball.node.probe)['collider ball follows'] == 'hand'


@with_tf2
def test_a_reset_leaves_a_collider_at_its_frame_and_the_cloth_at_rest(ball):
    assert ball.node.set(collider__ball__position=[1.0, -5.0, 1.0]) == ['']  # height of the sheet
    ball.follow(1.0)
    assert at_rest(ball.node.tick()[-1])
    ball.follow(-5.0)
    assert not at_rest(ball.node.tick()[-1])
    ball.node.reset()
    ball.place_frame(-5.0)
    assert ball.tick().pose.position.x == pytest.approx(-4.0, abs=1e-6)
    assert at_rest(ball.node.tick()[-1])


@with_tf2
def test_a_pose_in_a_frame_is_transformed(ball):
    assert ball.node.set(collider__ball__frame_id='') == ['']
    ball.tick()
    publisher = ball.node.probe.publisher(PoseStamped, '/ball/pose')
    quarter = math.pi / 2
    ball.place_frame(2.0, angle=quarter)
    command = pose(x=1.0, z=0.5, frame='hand')
    command.pose.orientation.z = command.pose.orientation.w = 5.0  # a quarter turn too
    publisher.publish(command)
    assert publisher.wait_for_all_acked(Duration(seconds=60))
    shown = ball.tick().pose
    place = shown.position
    np.testing.assert_allclose([place.x, place.y, place.z], [2.0, 6.0, 0.5], atol=1e-9)
    turn = shown.orientation
    np.testing.assert_allclose([turn.x, turn.y, turn.z, turn.w], [0, 0, 1, 0], atol=1e-9)
