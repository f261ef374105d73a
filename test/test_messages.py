"""Messages as other readers of CDR see them."""

import math

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from cloth_ros import Cloth, Scene
from cloth_ros.messages import cdr
from cloth_ros.messages.cloth_markers import ACTION_PLACEHOLDER
from cloth_ros.messages.marker import sentinel
from cloth_ros.messages.markers import MarkersMessage
from cloth_ros.messages.particles import _PLACEHOLDER, ParticlesMessage
from cloth_ros.model.forces.springs import spring_ends, spring_families
from cloth_ros.scene.parameter import one_line

STAMP = (1_700_000_001, 999_999_999)

# What messages are searched for when they are made.
MARKS = (
    np.array([cdr.STAMP.sec, cdr.STAMP.nanosec], np.uint32).tobytes(),
    np.array(sentinel(0, 18)).tobytes(),
    ACTION_PLACEHOLDER,
)

SCENES = {
    'default': Scene(),
    'everything': Scene(
        sheet={'rows': 5, 'columns': 8, 'position': (1, 2, 3)},
        sphere={'radius': 0.2},
        markers={'springs': True},
        pins=['0,:'],
        frame_id='a/frame_of_odd_length',
    ),
    'little': Scene(sheet={'rows': 3, 'columns': 4}, pins=[''], wind={'air_density': 0.0}),
    'chain': Scene(sheet={'rows': 1, 'columns': 9}),
    'column': Scene(sheet={'rows': 9, 'columns': 1}, pins=[''], frame_id='w'),
    'particle': Scene(sheet={'rows': 1, 'columns': 1}, wind={'air_density': 0.0}, pins=['']),
}


@pytest.fixture(params=SCENES)
def cloth(request: pytest.FixtureRequest) -> Cloth:
    cloth = Cloth(SCENES[request.param])
    if cloth.scene.has_air:
        cloth.wind = (1, 2, -3)
    cloth.advance(0.1)
    return cloth


def particles(cloth: Cloth) -> bytes:
    sheet = cloth.scene.sheet
    message = ParticlesMessage(sheet.rows, sheet.columns, cloth.scene.frame_id)
    message.serialise(cloth, 1, 1)  # what is written twice is what the second time says
    return message.serialise(cloth, *STAMP)


def markers(cloth: Cloth) -> bytes:
    message = MarkersMessage(cloth)
    message.serialise(cloth, 1, 1)
    return message.serialise(cloth, *STAMP)


def test_particles_read_by_rclpy(cloth):
    message = deserialize_message(particles(cloth), PointCloud2)
    sheet = cloth.scene.sheet
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == STAMP
    assert message.header.frame_id == cloth.scene.frame_id
    assert (message.height, message.width) == (sheet.rows, sheet.columns)
    assert (message.point_step, message.row_step) == (24, 24 * sheet.columns)
    assert message.is_dense
    assert not message.is_bigendian
    assert [field.name for field in message.fields] == ['x', 'y', 'z', 'vx', 'vy', 'vz']
    assert [field.offset for field in message.fields] == [0, 4, 8, 12, 16, 20]
    assert {(field.datatype, field.count) for field in message.fields} == {(7, 1)}
    numbers = np.frombuffer(message.data, np.float32).reshape(sheet.rows, sheet.columns, 6)
    assert np.array_equal(numbers[..., :3], cloth.positions.astype(np.float32))
    assert np.array_equal(numbers[..., 3:], cloth.velocities.astype(np.float32))


def test_markers_read_by_rclpy(cloth):
    message = deserialize_message(markers(cloth), MarkerArray)
    by_name = {marker.ns: marker for marker in message.markers}
    scene, p = cloth.scene, cloth.positions
    rows, columns = scene.sheet.rows, scene.sheet.columns
    sheet = rows > 1 and columns > 1
    lines = scene.markers.springs or (not sheet and rows * columns > 1)
    expected = {
        'sheet': sheet,
        'pins': scene.pinned().any(),
        'springs': lines,
        'sphere': scene.sphere.radius > 0,
        'wind': scene.has_air,
    }
    assert set(by_name) == {name for name, present in expected.items() if present}
    for marker in message.markers:
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == STAMP
        assert marker.header.frame_id == scene.frame_id
        assert marker.action == Marker.ADD
        assert marker.color.a == 1.0
        assert marker.scale.x > 0
        assert marker.pose.orientation.w == 1.0
        assert not marker.colors  # colours of its own would turn RViz's lighting off

    def points(name):
        return np.array([(point.x, point.y, point.z) for point in by_name[name].points])

    if sheet:
        assert by_name['sheet'].type == Marker.TRIANGLE_LIST
        corners = points('sheet').reshape(rows - 1, columns - 1, 2, 3, 3)
        assert np.array_equal(corners[:, :, 0, 0], p[:-1, :-1])
        assert np.array_equal(corners[:, :, 1, 0], p[1:, 1:])
        for triangle in (0, 1):  # the other diagonal is shared
            ends_of_it = {tuple(corner) for corner in corners[0, 0, triangle, 1:]}
            assert ends_of_it == {tuple(p[0, 1]), tuple(p[1, 0])}
        first = Cloth(scene).positions  # both turn the same way as the sheet itself
        normal = np.cross(first[0, 1] - first[0, 0], first[1, 0] - first[0, 0])
        for a, b, c in corners[0, 0]:
            assert np.cross(b - a, c - a) @ normal > 0
    if 'pins' in by_name:
        assert np.array_equal(points('pins'), p[scene.pinned()])
    if lines:
        pairs = points('springs').reshape(-1, 2, 3)
        grid = np.moveaxis(p, -1, 0)
        lengths = [
            np.linalg.norm(a - b, axis=0).ravel()
            for a, b in (spring_ends(family, grid) for family in spring_families(scene))
        ]
        found = np.linalg.norm(pairs[:, 0] - pairs[:, 1], axis=1)
        np.testing.assert_allclose(found, np.concatenate(lengths))
    if 'sphere' in by_name:
        position = by_name['sphere'].pose.position
        assert (position.x, position.y, position.z) == cloth.sphere_position
        assert by_name['sphere'].scale.z == 2 * scene.sphere.radius
    if 'wind' in by_name:
        start, tip = points('wind')
        np.testing.assert_allclose(
            (tip - start) / np.linalg.norm(tip - start), np.array((1, 2, -3)) / math.sqrt(14)
        )


def test_no_wind_deletes_its_arrow():
    cloth = Cloth(Scene())
    message = deserialize_message(markers(cloth), MarkerArray)
    assert {marker.ns: marker.action for marker in message.markers}['wind'] == Marker.DELETE


def test_rosbags_reads_the_same(cloth):
    store = get_typestore(Stores.ROS2_JAZZY)
    cloud = store.deserialize_cdr(particles(cloth), 'sensor_msgs/msg/PointCloud2')
    ours = deserialize_message(particles(cloth), PointCloud2)
    assert bytes(cloud.data) == bytes(ours.data)
    assert cloud.header.frame_id == cloth.scene.frame_id
    assert [field.name for field in cloud.fields] == [field.name for field in ours.fields]
    array = store.deserialize_cdr(markers(cloth), 'visualization_msgs/msg/MarkerArray')
    theirs = deserialize_message(markers(cloth), MarkerArray)
    for one, other in zip(array.markers, theirs.markers, strict=True):
        assert (one.ns, one.type, one.action) == (other.ns, other.type, other.action)
        assert [(q.x, q.y, q.z) for q in one.points] == [(q.x, q.y, q.z) for q in other.points]
        assert one.mesh_resource == ''


@pytest.mark.parametrize(
    'frame_id',
    [
        '',
        'abcdefghijklmnopqrstuvwxyz',
        'abcdefghijklmnopqrstuvwx' * 3,
        _PLACEHOLDER.decode('latin-1'),
        'f' * 256,
        '縁' * 256,
        'ÿ𝄞' * 31,
        'sheet/pins/springs/wind/sphere',
        *(
            one_line(mark.decode(code, 'ignore'))
            for mark in MARKS
            for code in ('utf-8', 'latin-1')
        ),
    ],
)
def test_a_frame_may_have_any_name(frame_id):
    cloth = Cloth(Scene(frame_id=frame_id, sphere={'radius': 0.5}, markers={'springs': True}))
    cloth.advance(0.1)
    cloud = deserialize_message(particles(cloth), PointCloud2)
    assert cloud.header.frame_id == frame_id
    assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec) == STAMP
    numbers = np.frombuffer(cloud.data, np.float32).reshape(32, 32, 6)
    assert np.array_equal(numbers[..., :3], cloth.positions.astype(np.float32))
    array = deserialize_message(markers(cloth), MarkerArray)
    assert [each.ns for each in array.markers] == ['sheet', 'pins', 'springs', 'wind', 'sphere']
    for marker in array.markers:
        assert marker.header.frame_id == frame_id
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == STAMP
        assert marker.pose.orientation.w == 1.0


def test_many_sizes_keep_the_cdr_aligned():
    """What follows a stretched sequence is read right, whatever the lengths before it."""
    for length in range(1, 12):
        for columns in (1, 2, 3):
            cloth = Cloth(
                Scene(
                    frame_id='f' * length,
                    sheet={'rows': 2, 'columns': columns},
                    sphere={'radius': 0.5},
                    markers={'springs': True},
                )
            )
            message = deserialize_message(markers(cloth), MarkerArray)
            assert all(marker.pose.orientation.w == 1.0 for marker in message.markers)
            assert message.markers[-1].ns == 'sphere'
            cloud = deserialize_message(particles(cloth), PointCloud2)
            assert cloud.is_dense
            assert len(cloud.data) == 48 * columns
