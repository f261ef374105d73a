"""What a node publishes in real time, as rclpy and a DDS of another make receive it."""

import functools
import importlib
import itertools
import json
import math
import re
import time

import numpy as np
import pytest
import yaml
from builders import ROOT
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from node.conftest import FREE_FALL, durations, running
from ros import PATIENCE, diagnosis, numbers, regular, set_parameters, stamp
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

SCENE = 'config/gust.yaml'
ROWS = COLUMNS = 36
SHARED_MEMORY = 2**24  # bytes


@pytest.fixture(scope='module')
def node():
    with running('--params-file', SCENE, frame_id='lab') as (process, probe):
        yield process, probe


def test_particles_have_their_layout_rate_stamps_and_velocities(node):
    _, probe = node
    particles: list[PointCloud2] = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 60))
    stamps = np.array([stamp(message) for message in particles])
    assert np.diff(stamps).min() > 0
    assert -0.1 < time.time() - stamps[-1] < PATIENCE  # they are of the system clock
    cloud = particles[-1]
    assert (cloud.height, cloud.width, cloud.point_step) == (ROWS, COLUMNS, 24)
    assert cloud.header.frame_id == 'lab'


def test_particles_can_be_rarer_than_ticks_and_without_velocities(node):
    _, probe = node
    results = set_parameters(probe, particles__rate=20.0, particles__velocities=False)
    assert [result.reason for result in results] == ['', '']
    particles: list[PointCloud2] = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 20))
    assert [field.name for field in particles[-1].fields] == ['x', 'y', 'z']
    assert numbers(particles[-1]).shape == (ROWS, COLUMNS, 3)
    assert len(particles[-1].data) == 12 * ROWS * COLUMNS
    results = set_parameters(probe, particles__rate=0.0, particles__velocities=True)
    assert [result.reason for result in results] == ['', '']
    probe.spin_until(lambda: particles[-1].point_step == 24)
    particles.clear()
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 60))


def test_markers_have_their_namespaces_and_rate(node):
    _, probe = node
    markers: list[MarkerArray] = probe.collect(MarkerArray, '/cloth/markers')
    probe.spin_until(lambda: regular([stamp(message.markers[0]) for message in markers], 1 / 30))
    assert {each.ns for each in markers[-1].markers} == {'sheet', 'pins', 'sphere', 'wind'}
    assert {each.header.frame_id for each in markers[-1].markers} == {'lab'}


def test_diagnostics_describe_the_simulation_each_second(node):
    _, probe = node
    messages: list[DiagnosticArray] = probe.collect(DiagnosticArray, '/diagnostics')
    probe.spin_until(lambda: regular_seconds([stamp(message) for message in messages]))
    found: dict[str, str] = {}

    def in_real_time() -> bool:
        found.update(diagnosis(probe))
        estimated = 'sampled' not in found['error estimate [m]']
        return estimated and abs(float(found['real-time factor']) - 1) < 0.05

    probe.spin_until(in_real_time)
    assert found['name'] == '/cloth: simulation'
    # The limit is that of every state, and that of a flat sheet is longer.
    assert 0 < float(found['substep [s]']) < 1.25 * float(found['stability limit [s]'])
    assert int(found['substeps in the last tick']) > 10
    for key in (
        'energy [J]',
        'largest stretch',
        'largest shear angle [rad]',
        'largest fold angle [rad]',
        'error estimate [m]',
        'load [share of real time]',
        'waited for a processor [s]',
    ):
        assert math.isfinite(float(found[key]))
    # Of the window that ended so long ago, in simulated time.
    assert 0 < float(found['error estimate, window [s]']) <= 1.0
    assert float(found['error estimate, age [s]']) > 0
    assert found['rejected inputs'] == '0'


def strings_in(value: object) -> list[str]:
    """Return all strings in nested lists and dictionaries, keys included."""
    if isinstance(value, dict):
        return strings_in([*value.keys(), *value.values()])
    if isinstance(value, list):
        return [text for each in value for text in strings_in(each)]
    return [value] if isinstance(value, str) else []


def panels_in(tree: object) -> list[str]:
    """Return the panels that a layout of Foxglove arranges."""
    if isinstance(tree, str):
        return [tree]
    return panels_in(tree['first']) + panels_in(tree['second'])


def test_views_of_rviz_and_foxglove_show_topics_and_values_that_are_published(node):
    _, probe = node
    topics = {f'/cloth/{name}' for name in ('markers', 'particles')} | {'/diagnostics'}
    probe.spin_until(lambda: topics <= dict(probe.get_topic_names_and_types()).keys())
    found = diagnosis(probe)

    layout = json.loads((ROOT / 'config' / 'cloth.foxglove.json').read_text())
    panels = layout['configById']
    assert sorted(panels_in(layout['layout'])) == sorted(panels)
    assert {each.partition('!')[0] for each in panels} == {'3D', 'Plot', 'DiagnosticStatusPanel'}
    texts = strings_in(layout)
    assert {re.split(r'[.\[]', text)[0] for text in texts if text.startswith('/')} == {
        *topics,
        found['name'],
    }
    plotted = re.findall(r'\.values\[:\]\{key=="(.*?)"\}\.value', '\n'.join(texts))
    paths = [text for text in texts if text.startswith('/diagnostics.')]
    assert len(plotted) == len(paths) == 5
    assert set(plotted) <= found.keys()

    view = yaml.safe_load((ROOT / 'config' / 'cloth.rviz').read_text())['Visualization Manager']
    shown = [each['Topic'] for each in view['Displays'] if 'Topic' in each]
    assert {f'/{each["Value"]}' for each in shown} == topics - {'/diagnostics'}
    # As the node publishes: a reliable queue that a burst does not overflow.
    assert all(each['Reliability Policy'] == 'Reliable' for each in shown)


def regular_seconds(stamps: list[float]) -> bool:
    """Return True once two messages in a row were a second apart."""
    return any(abs(pause - 1) < 0.05 for pause in np.diff(stamps))


# Cyclone DDS encodes and decodes messages itself, and knows no ROS.

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
# Stay on this machine, as the node does under test.
LOCAL = """<General><AllowMulticast>false</AllowMulticast><Interfaces><NetworkInterface
address="127.0.0.1"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>"""
BASIC = {
    'boolean': bool,
    'double': types.float64,
    'float': types.float32,
    'int32': types.int32,
    'octet': types.uint8,
    'string': str,
    'uint32': types.uint32,
    'uint8': types.uint8,
}


def idl_type(name: str):
    """Return the type of a field in IDL, from its name in ROS."""
    if sequence := re.fullmatch(r'sequence<(.+)>', name):
        return types.sequence[idl_type(sequence[1])]
    if name in BASIC:
        return BASIC[name]
    package, message = name.split('/')
    return idl_struct(getattr(importlib.import_module(f'{package}.msg'), message))


@functools.cache
def idl_struct(message: type) -> type:
    """Return a message type of ROS as Cyclone DDS declares it."""
    fields = {name: idl_type(kind) for name, kind in message.get_fields_and_field_types().items()}
    package, name = message.__module__.partition('.')[0], message.__name__
    return make_idl_struct(name, f'{package}::msg::dds_::{name}_', fields)


class Cyclone:
    """A participant in a domain."""

    def __init__(self, domain: int) -> None:
        self._domain = Domain(domain, LOCAL)  # as long as this is held
        self._participant = DomainParticipant(domain)

    def _topic(self, kind: type, topic: str) -> Topic:
        return Topic(self._participant, f'rt{topic}', idl_struct(kind))

    def messages(self, kind: type, topic: str):
        """Yield the messages of a topic."""
        reader = DataReader(self._participant, self._topic(kind, topic), qos=RELIABLE)
        yield from reader.take_iter(timeout=duration(seconds=PATIENCE))
        raise AssertionError('nothing came')

    def writer(self, kind: type, topic: str) -> DataWriter:
        return DataWriter(self._participant, self._topic(kind, topic), qos=RELIABLE)


def test_cyclone_dds_receives_the_cloth_and_commands_it(node):
    _, probe = node
    cyclone = Cyclone(probe.context.get_domain_id())
    cloud = next(cyclone.messages(PointCloud2, '/cloth/particles'))
    assert (cloud.height, cloud.width, cloud.header.frame_id) == (ROWS, COLUMNS, 'lab')
    assert [field.name for field in cloud.fields] == ['x', 'y', 'z', 'vx', 'vy', 'vz']
    first_row = np.frombuffer(bytes(cloud.data), np.float32).reshape(ROWS, COLUMNS, 6)[0]
    pins = first_row[::5, 0]
    np.testing.assert_allclose(pins, np.linspace(-0.5, 0.5, COLUMNS)[::5], atol=1e-6)
    assert cloud.is_dense
    report = next(cyclone.messages(DiagnosticArray, '/diagnostics'))
    assert report.status[0].name == '/cloth: simulation'

    blow = cyclone.writer(Vector3Stamped, '/wind')
    header = idl_type('std_msgs/Header')(idl_type('builtin_interfaces/Time')(0, 0), '')
    command = idl_struct(Vector3Stamped)(header, idl_type('geometry_msgs/Vector3')(0.0, 0.0, 6.0))
    for array in cyclone.messages(MarkerArray, '/cloth/markers'):
        blow.write(command)  # until the node has discovered the writer
        markers = {marker.ns: marker for marker in array.markers}
        if 'wind' not in markers:  # the first message, which deletes all
            continue
        start, tip = markers['wind'].points
        if markers['wind'].action == Marker.ADD and tip.z - start.z > 0.5:
            break
    assert len(markers['sheet'].points) == 6 * (ROWS - 1) * (COLUMNS - 1)
    assert markers['sphere'].scale.x == 0.3
    assert all(marker.pose.orientation.w == 1.0 for marker in array.markers)


def test_stamps_are_those_of_the_states(node):
    """The last test of this node: afterwards its sheet falls for ever."""
    _, probe = node
    assert all(result.successful for result in set_parameters(probe, **FREE_FALL))
    probe.spin_until(lambda: diagnosis(probe)['stability limit [s]'] == 'inf')
    particles: list[PointCloud2] = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(particles) > 30)
    for pair in itertools.pairwise(particles):
        if stamp(pair[1]) - stamp(pair[0]) < 0.1:  # no time was lost between them
            durations(pair)
