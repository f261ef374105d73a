"""The topics as Cyclone DDS sees them, a DDS of another make, which knows no ROS."""

import sys
from dataclasses import dataclass

import numpy as np
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float32, float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
BATCH = 20
# Stay on this machine, as the node does under test.
LOCAL = """<General><AllowMulticast>false</AllowMulticast><Interfaces><NetworkInterface
address="127.0.0.1"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>"""


@dataclass
class Time(IdlStruct, typename='builtin_interfaces::msg::dds_::Time_'):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename='std_msgs::msg::dds_::Header_'):
    stamp: Time
    frame_id: str


@dataclass
class PointField(IdlStruct, typename='sensor_msgs::msg::dds_::PointField_'):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, typename='sensor_msgs::msg::dds_::PointCloud2_'):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class Point(IdlStruct, typename='geometry_msgs::msg::dds_::Point_'):
    x: float64
    y: float64
    z: float64


@dataclass
class Vector3(IdlStruct, typename='geometry_msgs::msg::dds_::Vector3_'):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename='geometry_msgs::msg::dds_::Quaternion_'):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename='geometry_msgs::msg::dds_::Pose_'):
    position: Point
    orientation: Quaternion


@dataclass
class ColorRGBA(IdlStruct, typename='std_msgs::msg::dds_::ColorRGBA_'):
    r: float32
    g: float32
    b: float32
    a: float32


@dataclass
class Duration(IdlStruct, typename='builtin_interfaces::msg::dds_::Duration_'):
    sec: int32
    nanosec: uint32


@dataclass
class CompressedImage(IdlStruct, typename='sensor_msgs::msg::dds_::CompressedImage_'):
    header: Header
    format: str
    data: sequence[uint8]


@dataclass
class UVCoordinate(IdlStruct, typename='visualization_msgs::msg::dds_::UVCoordinate_'):
    u: float32
    v: float32


@dataclass
class MeshFile(IdlStruct, typename='visualization_msgs::msg::dds_::MeshFile_'):
    filename: str
    data: sequence[uint8]


@dataclass
class Marker(IdlStruct, typename='visualization_msgs::msg::dds_::Marker_'):
    header: Header
    ns: str
    id: int32
    type: int32
    action: int32
    pose: Pose
    scale: Vector3
    color: ColorRGBA
    lifetime: Duration
    frame_locked: bool
    points: sequence[Point]
    colors: sequence[ColorRGBA]
    texture_resource: str
    texture: CompressedImage
    uv_coordinates: sequence[UVCoordinate]
    text: str
    mesh_resource: str
    mesh_file: MeshFile
    mesh_use_embedded_materials: bool


@dataclass
class MarkerArray(IdlStruct, typename='visualization_msgs::msg::dds_::MarkerArray_'):
    markers: sequence[Marker]


@dataclass
class Vector3Stamped(IdlStruct, typename='geometry_msgs::msg::dds_::Vector3Stamped_'):
    header: Header
    vector: Vector3


def read(reader: DataReader, count: int) -> list:
    samples: list = []
    for sample in reader.take_iter(timeout=duration(seconds=20)):
        samples.append(sample)
        if len(samples) >= count:
            break
    assert len(samples) >= count, 'nothing came'
    return samples


def test_cyclone_receives_the_cloth_and_commands_it(start, domain):
    node = start(
        sys.executable,
        '-m',
        'cloth_ros.node.main',
        '--ros-args',
        '-p',
        'sheet.rows:=7',
        '-p',
        'sheet.columns:=9',
        '-p',
        'gravity:=[0.0, 0.0, 0.0]',
        '-p',
        'sphere.radius:=0.2',
        '-p',
        'frame_id:=lab',
    )
    node.wait_for_output('publishing')
    local = Domain(domain, LOCAL)  # as long as this is held
    participant = DomainParticipant(domain)
    particles = DataReader(
        participant, Topic(participant, 'rt/cloth/particles', PointCloud2), qos=RELIABLE
    )
    markers = DataReader(
        participant, Topic(participant, 'rt/cloth/markers', MarkerArray), qos=RELIABLE
    )
    cloud = read(particles, BATCH)[-1]
    assert (cloud.height, cloud.width, cloud.header.frame_id) == (7, 9, 'lab')
    assert [field.name for field in cloud.fields] == ['x', 'y', 'z', 'vx', 'vy', 'vz']
    numbers = np.frombuffer(bytes(cloud.data), np.float32).reshape(7, 9, 6)
    np.testing.assert_allclose(numbers[0, :, 0], np.linspace(-0.5, 0.5, 9), atol=1e-3)
    assert cloud.is_dense

    by_name = {marker.ns: marker for marker in read(markers, 3)[-1].markers}
    assert set(by_name) == {'sheet', 'pins', 'sphere', 'wind'}
    assert len(by_name['sheet'].points) == 6 * 8 * 6
    assert by_name['sphere'].scale.x == 0.4
    assert all(marker.pose.orientation.w == 1.0 for marker in by_name.values())

    topic = Topic(participant, 'rt/wind', Vector3Stamped)
    writer = DataWriter(participant, topic, qos=RELIABLE)
    message = Vector3Stamped(Header(Time(0, 0), ''), Vector3(0.0, 0.0, 6.0))
    for _ in range(20):  # until the node has discovered the writer
        writer.write(message)
        cloud = read(particles, BATCH)[-1]
        numbers = np.frombuffer(bytes(cloud.data), np.float32).reshape(7, 9, 6)
        if numbers[..., 5].max() > 0.1:
            break
    else:
        raise AssertionError('the wind was not felt')
    del local
