"""Grippers of a running node: services, topics, parameters, markers, and an exact repetition."""

import json
from collections.abc import Iterator

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, WrenchStamped
from node.conftest import SteppedCloth, at_rest
from ros import diagnosis, pose
from std_msgs.msg import String, UInt8MultiArray
from std_srvs.srv import SetBool
from visualization_msgs.msg import MarkerArray

from cloth_ros.live.keyframe import decode_keyframe
from cloth_ros.live.tick_record import decode_record
from cloth_ros.recording.repeated_cloth import RepeatedCloth

# At a free corner of the sheet, which floats at z = 1 and is pinned at the other two.
CORNER = (-0.5, 0.5, 1.0)
GRIPPER = {
    'gripper.left.radius': 0.15,
    'gripper.left.position': list(CORNER),
    'gripper.left.slip_force': 0.0,
    'gripper.names': ['left'],
}


@pytest.fixture
def node(cloth: SteppedCloth) -> Iterator[SteppedCloth]:
    """The stepped node with a gripper, which holds nothing."""
    markers = cloth.probe.collect(MarkerArray, '/cloth/markers')
    assert cloth.set_together(GRIPPER) == ''
    cloth.tick_until(lambda _: any(each.ns == 'left' for m in markers for each in m.markers))
    yield cloth
    assert cloth.set(gripper__names=['']) == ['']
    cloth.probe.spin_until(lambda: not cloth.probe.count_subscribers('/left/pose'))


def call(node: SteppedCloth, data: bool) -> SetBool.Response:
    return node.probe.call(SetBool, '/left/grasp', SetBool.Request(data=data))


def test_a_gripper_takes_moves_and_releases_and_a_repetition_has_the_same_bits(node):
    probe = node.probe
    wrenches = probe.collect(WrenchStamped, '/left/wrench')
    markers = probe.collect(MarkerArray, '/cloth/markers')
    records = probe.collect(String, '/cloth/ticks', 1000)
    keyframes = probe.collect(UInt8MultiArray, '/cloth/keyframes')
    node.tick_until(lambda _: keyframes)
    answer = call(node, data=True)
    assert (answer.success, answer.message) == (True, 'left holds 3 particles')
    publisher = probe.publisher(PoseStamped, '/left/pose')
    target = (-0.45, 0.45, 1.1)
    publisher.publish(pose(*target))
    state = node.tick_until(lambda state: not at_rest(state))
    while np.linalg.norm(state[-1, 0, :3] - target) > 1e-6:
        publisher.publish(pose(*target))
        state = node.tick()[-1]
    wrenches.clear()
    state = node.tick(3)[-1]
    assert state[-1, 0, 3:] == pytest.approx((0, 0, 0), abs=1e-9)
    assert np.linalg.norm(state[-1, 0, :3] - state[-1, 1, :3]) == pytest.approx(0.125, abs=1e-6)
    probe.spin_until(lambda: wrenches)
    force = wrenches[-1].wrench.force
    assert np.linalg.norm((force.x, force.y, force.z)) > 0.01  # the springs pull it back
    markers.clear()
    node.tick_until(lambda _: markers)
    (shown,) = [each for each in markers[-1].markers if each.ns == 'left']
    assert (shown.pose.position.x, shown.scale.x) == (target[0], 0.3)
    assert shown.color.g > shown.color.r  # holding
    assert diagnosis(probe)['left held particles'] == '3'

    answer = call(node, data=False)
    assert (answer.success, answer.message) == (True, 'left releases 3 particles')
    node.tick_until(lambda state: np.linalg.norm(state[-1, 0, :3] - target) > 1e-3)
    publisher.publish(pose(3.0, 3.0, 3.0))
    node.tick_until(lambda _: 'left' in json.loads(records[-1].data).get('grippers', {}))
    answer = call(node, data=True)
    assert not answer.success
    assert "the distance of 'left' from the nearest particle that it can take is" in answer.message

    # What was recorded is repeated, and gives the same states.
    node.tick(2)
    start = decode_keyframe(bytes(keyframes[0].data))
    repeated, states = RepeatedCloth(), {}
    for message in node.states:
        states[message.header.stamp.sec * 10**9 + message.header.stamp.nanosec] = message
    repeated.start(start)
    compared = grasps = 0
    for text in records:
        record = decode_record(text.data)
        if record.tick <= start.tick:
            continue
        repeated.repeat(record)
        grasps += len(record.grips)
        if record.stamp in states:
            recorded = np.frombuffer(states[record.stamp].data, np.float32)
            assert np.array_equal(recorded, repeated.particles().ravel())
            compared += 1
    assert grasps == 2
    assert compared > 5


def test_a_reset_opens_grippers_and_their_services_come_and_go(node):
    assert call(node, data=True).success
    node.tick()
    node.reset()
    node.tick()
    assert diagnosis(node.probe)['left held particles'] == '0'
    (reason,) = node.set(gripper__names=['left', 'sphere'])
    assert reason.startswith(
        "gripper.names[1] is 'sphere', but must be other than that of a topic"
    )
    ball = {'collider.left.type': 'sphere', 'collider.left.radius': 0.1}
    reason = node.set_together({**ball, 'collider.names': ['left']})
    assert reason.startswith("gripper.names[0] is 'left', but must be a name that is not in coll")
    (reason,) = node.set(gripper__right__radius=0.1)
    assert reason == "no effect until 'right' is in gripper.names"
    assert node.set(gripper__left__frame_id='hand') == ['']
    publisher = node.probe.publisher(PoseStamped, '/left/pose')
    publisher.publish(pose(0.0, 0.0, 2.0))
    node.tick(2)
    found = diagnosis(node.probe)
    assert 'hand' in found['gripper left follows']
