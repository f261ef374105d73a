"""Topics of a running node, recorded as rosbag2 does, in both of its storages, and read back."""

import itertools
from contextlib import ExitStack
from functools import partial

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from node.conftest import PERIOD, SteppedCloth, running
from rcl_interfaces.msg import ParameterEvent
from rclpy.qos import DurabilityPolicy, QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.serialization import deserialize_message
from ros import FLOATING, SPHERE, pose, wind
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String, UInt8MultiArray
from visualization_msgs.msg import MarkerArray

from cloth_ros.live.tick_record import decode_record
from cloth_ros.recording.bag import Bag
from cloth_ros.recording.run import repeat

TOPICS = {
    '/cloth/particles': PointCloud2,
    '/cloth/markers': MarkerArray,
    '/cloth/ticks': String,
    '/cloth/keyframes': UInt8MultiArray,
    '/cloth/scene': String,
    '/diagnostics': DiagnosticArray,
    '/parameter_events': ParameterEvent,
    '/wind': Vector3Stamped,
    '/sphere_pose': PoseStamped,
}
STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
TICKS = 20


def stamp_of(message):
    """Return the time of the state that a message shows, ns."""
    if isinstance(message, String):
        return decode_record(message.data).stamp
    header = message.header if isinstance(message, PointCloud2) else message.markers[0].header
    return header.stamp.sec * 10**9 + header.stamp.nanosec


class Recorder:
    """Write what is published to bags; the quality of service is adapted as rosbag2 does."""

    def __init__(self, probe, bags) -> None:
        self.messages: dict[str, list[bytes]] = {topic: [] for topic in TOPICS}
        self.durability: dict[str, DurabilityPolicy] = {}
        self._received = itertools.count(1)
        for topic, kind in TOPICS.items():
            offers = probe.get_publishers_info_by_topic(topic)
            assert offers, topic
            for offer in offers:
                result, reason = qos_check_compatible(offer.qos_profile, QoSProfile(depth=10))
                assert result != QoSCompatibility.ERROR, (topic, reason)
            (self.durability[topic],) = {offer.qos_profile.durability for offer in offers}
            profile = QoSProfile(depth=1000, durability=self.durability[topic])
            name = f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
            types = get_typestore(Stores.ROS2_JAZZY)
            writes = [
                partial(bag.write, bag.add_connection(topic, name, typestore=types))
                for bag in bags
            ]
            take = partial(self._take, self.messages[topic], writes)
            probe.create_subscription(kind, topic, take, profile, raw=True)

    def _take(self, messages, writes, data) -> None:
        messages.append(data)
        received = next(self._received)
        for write in writes:
            write(received, data)

    def newest_stamps(self) -> set[int]:
        """Return the times of the newest state of each topic that each tick publishes, ns."""
        topics = ('/cloth/particles', '/cloth/markers', '/cloth/ticks')
        return {
            stamp_of(deserialize_message(self.messages[topic][-1], TOPICS[topic]))
            for topic in topics
        }


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    """A recorder, and its bag in each storage."""
    folder = tmp_path_factory.mktemp('traffic')
    parameters = {'use_sim_time': 'true', 'rate': 1 / PERIOD, 'markers__rate': 1 / PERIOD}
    with running(**parameters, **FLOATING, **SPHERE) as (process, probe), ExitStack() as stack:
        cloth = SteppedCloth(process, probe)
        bags = [
            stack.enter_context(Writer(folder / name, version=9, storage_plugin=plugin))
            for name, plugin in STORAGES.items()
        ]
        recorder = Recorder(probe, bags)
        messages = recorder.messages
        cloth.tick_until(
            lambda _: all(
                messages[f'/cloth/{name}'] for name in ('ticks', 'keyframes', 'scene', 'markers')
            )
        )
        cloth.send_and_wait('/wind', wind(0.0, 2.0, 1.0))
        cloth.send_and_wait('/sphere_pose', pose(0.1, 0.0, 1.05))
        cloth.tick(TICKS)
        assert cloth.set(particles__velocities=False) == ['']
        cloth.tick(TICKS)
        stamp = stamp_of(cloth.states[-1])
        probe.spin_until(lambda: recorder.newest_stamps() == {stamp})
        probe.spin_until(lambda: messages['/parameter_events'])
    return recorder, folder


@pytest.mark.parametrize('storage', STORAGES)
def test_a_recording_has_every_message_and_is_repeated_to_the_bit(recording, storage):
    recorder, folder = recording
    found: dict[str, list[bytes]] = {topic: [] for topic in TOPICS}
    for message in Bag(folder / storage).messages():
        found[message.topic].append(message.data)
    assert found == recorder.messages

    texts = [deserialize_message(data, String).data for data in found['/cloth/ticks']]
    records = [decode_record(text) for text in texts]
    ticks = [record.tick for record in records]
    assert len(ticks) > 2 * TICKS
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    for topic in ('/cloth/particles', '/cloth/markers'):
        kind, stamps = TOPICS[topic], []
        for data in found[topic]:
            stamps.append(stamp_of(deserialize_message(data, kind)))
        # A subscriber may be discovered by one publisher of the node some ticks before the other.
        begin = max(stamps[0], records[0].stamp)
        published = [record.stamp for record in records if record.stamp >= begin]
        # Markers are preceded by a message that deletes all, for each new subscriber.
        assert sorted({each for each in stamps if each >= begin}) == published, topic

    outcome = repeat(folder / storage, None, lambda *_: None)
    assert outcome.result['differing states'] == 0
    assert outcome.result['states'] > 2 * TICKS
    assert outcome.result['gaps'] == outcome.result['defects'] == []
    assert outcome.identical


def test_only_the_scene_is_sent_to_late_subscribers(recording):
    recorder, _ = recording
    late = {
        topic
        for topic, durability in recorder.durability.items()
        if durability == DurabilityPolicy.TRANSIENT_LOCAL
    }
    assert late == {'/cloth/scene'}
