"""Messages as other readers of CDR see them."""

import numpy as np
import pytest
from builders import scene_of
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from cloth_ros import Cloth, Scene
from cloth_ros.messages import cdr
from cloth_ros.messages.cloth_markers import ACTION_PLACEHOLDER
from cloth_ros.messages.markers import MARKERS, MarkersMessage, deletion
from cloth_ros.messages.particles import _PLACEHOLDER, ParticlesMessage
from cloth_ros.model.forces.springs import spring_ends, spring_families
from cloth_ros.scene.parameter import one_line

STAMP = (1_700_000_001, 999_999_999)
WIND = (1.0, 2.0, -3.0)

# Bytes that a message is searched for when it is made: a frame may be named like them.
PLACEHOLDERS = (
    _PLACEHOLDER,
    np.array([cdr.STAMP.sec, cdr.STAMP.nanosec], np.uint32).tobytes(),
    np.array(cdr.sentinel(0, 18)).tobytes(),
    ACTION_PLACEHOLDER,
)
frames = st.one_of(
    st.integers(0, 26).map(lambda length: 'f' * length),
    st.text(st.characters(exclude_categories=['C', 'Z']), max_size=60).map(one_line),
    st.sampled_from(['f' * 256, '縁' * 256, 'ÿ𝄞' * 31, 'sheet/pins/springs/wind/sphere']),
    st.sampled_from(
        [one_line(mark.decode(code, 'ignore')) for mark in PLACEHOLDERS
         for code in ('utf-8', 'latin-1')]
    ),
)  # fmt: skip


@st.composite
def cloths(draw: st.DrawFn) -> Cloth:
    """Draw a cloth of any shape, with any of the markers, in an arbitrary state."""
    rows, columns = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    scene = scene_of(
        sheet={'rows': rows, 'columns': columns, 'position': (1, 2, 3)},
        sphere={'radius': draw(st.sampled_from([0.0, 0.2])), 'position': (1, 2, 5)},
        particles={'velocities': draw(st.booleans())},
        markers={'springs': draw(st.booleans())},
        wind={'air_density': draw(st.sampled_from([0.0, 1.2]))},
        pins=draw(st.sampled_from([[''], ['0,:'], ['0,0', '-1,-1']])),
        frame_id=draw(frames),
    )
    cloth = Cloth(scene)
    generator = np.random.default_rng(draw(st.integers(0, 2**31)))
    cloth.positions = cloth.positions + generator.uniform(-1e-3, 1e-3, (rows, columns, 3))
    cloth.velocities = generator.uniform(-1, 1, (rows, columns, 3))
    if draw(st.booleans()):
        cloth.wind = WIND
    return cloth


def particles(cloth: Cloth) -> bytes:
    scene, sheet = cloth.scene, cloth.scene.sheet
    message = ParticlesMessage(
        sheet.rows, sheet.columns, scene.frame_id, scene.particles.velocities
    )
    message.serialise(Cloth(cloth.scene), 1, 1)  # the second state overwrites the first
    return message.serialise(cloth, *STAMP)


def markers(cloth: Cloth) -> bytes:
    message = MarkersMessage(cloth)
    message.serialise(Cloth(cloth.scene), 1, 1)
    return message.serialise(cloth, *STAMP)


def check_header(header, scene: Scene) -> None:
    assert (header.stamp.sec, header.stamp.nanosec) == STAMP
    assert header.frame_id == scene.frame_id


@given(cloth=cloths())
def test_particles_are_read_as_they_are(cloth):
    data = particles(cloth)
    message = deserialize_message(data, PointCloud2)
    sheet = cloth.scene.sheet
    check_header(message.header, cloth.scene)
    assert (message.height, message.width) == (sheet.rows, sheet.columns)
    names = ['x', 'y', 'z', 'vx', 'vy', 'vz'][: 6 if cloth.scene.particles.velocities else 3]
    step = 4 * len(names)
    assert (message.point_step, message.row_step) == (step, step * sheet.columns)
    assert message.is_dense
    assert not message.is_bigendian
    assert [field.name for field in message.fields] == names
    assert [field.offset for field in message.fields] == list(range(0, step, 4))
    assert {(field.datatype, field.count) for field in message.fields} == {(7, 1)}
    numbers = np.frombuffer(message.data, np.float32).reshape(sheet.rows, sheet.columns, -1)
    assert np.array_equal(numbers[..., :3], cloth.positions.astype(np.float32))
    velocities = cloth.velocities.astype(np.float32)
    assert np.array_equal(numbers[..., 3:], velocities[..., : len(names) - 3])
    other = STORE.deserialize_cdr(data, 'sensor_msgs/msg/PointCloud2')
    assert bytes(other.data) == bytes(message.data)
    assert other.header.frame_id == cloth.scene.frame_id
    assert [field.name for field in other.fields] == [field.name for field in message.fields]


STORE = get_typestore(Stores.ROS2_JAZZY)


@given(cloth=cloths())
def test_markers_are_read_as_they_are(cloth):
    data = markers(cloth)
    message = deserialize_message(data, MarkerArray)
    by_name = {marker.ns: marker for marker in message.markers}
    scene, p = cloth.scene, cloth.positions
    rows, columns = p.shape[:2]
    triangles = rows > 1 and columns > 1
    expected = {
        'sheet': triangles,
        'pins': scene.pinned().any(),
        'springs': rows * columns > 1 and (scene.markers.springs or not triangles),
        'wind': scene.has_air,
        'sphere': scene.sphere.radius > 0,
    }
    assert list(by_name) == [name for name, present in expected.items() if present]
    for marker in message.markers:
        check_header(marker.header, scene)
        still = marker.ns == 'wind' and cloth.wind != WIND
        assert marker.action == (Marker.DELETE if still else Marker.ADD)
        assert marker.color.a == 1.0
        assert marker.scale.x > 0
        assert marker.pose.orientation.w == 1.0
        assert not marker.colors  # colours per vertex would turn RViz's lighting off

    def points(name):
        return np.array([(point.x, point.y, point.z) for point in by_name[name].points])

    if triangles:
        assert by_name['sheet'].type == Marker.TRIANGLE_LIST
        corners = points('sheet').reshape(rows - 1, columns - 1, 2, 3, 3)
        right, down = p[:-1, 1:], p[1:, :-1]  # both turn the same way as the sheet
        ends = [(p[:-1, :-1], right, down), (p[1:, 1:], down, right)]
        cyclic = [
            [np.roll(corners[:, :, k], shift, axis=2) for shift in range(3)] for k in range(2)
        ]
        for rotations, triangle in zip(cyclic, ends, strict=True):
            assert any(np.array_equal(each, np.stack(triangle, axis=2)) for each in rotations)
    if 'pins' in by_name:
        assert np.array_equal(points('pins'), p[scene.pinned()])
    if 'springs' in by_name:
        grid = np.moveaxis(p, -1, 0)
        pairs = [spring_ends(family, grid) for family in spring_families(scene)]
        ends = [np.concatenate([pair[k].reshape(3, -1).T for pair in pairs]) for k in (0, 1)]
        assert np.array_equal(points('springs').reshape(-1, 2, 3), np.stack(ends, axis=1))
    if 'sphere' in by_name:
        position = by_name['sphere'].pose.position
        assert (position.x, position.y, position.z) == cloth.sphere_position
        assert by_name['sphere'].scale.z == 2 * scene.sphere.radius
    if 'wind' in by_name:
        start, tip = points('wind')
        np.testing.assert_allclose(tip - start, 0.1 * np.array(cloth.air_velocity), atol=1e-12)
    other = STORE.deserialize_cdr(data, 'visualization_msgs/msg/MarkerArray')
    for one, two in zip(other.markers, message.markers, strict=True):
        assert (one.ns, one.type, one.action) == (two.ns, two.type, two.action)
        assert [(q.x, q.y, q.z) for q in one.points] == [(q.x, q.y, q.z) for q in two.points]
        assert one.mesh_resource == ''


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_large_sheet_in_motion(precision):
    """All markers, in the precision of the model, after an advance."""
    cloth = Cloth(scene_of(markers__springs=True, sphere__radius=0.1, solver__precision=precision))
    cloth.move_sphere((0.0, 0.2, 3.0))
    cloth.advance(0.02)
    test_particles_are_read_as_they_are.hypothesis.inner_test(cloth)
    test_markers_are_read_as_they_are.hypothesis.inner_test(cloth)


def test_markers_that_are_no_longer_published_can_be_deleted():
    cloth = Cloth(
        scene_of(
            sphere__radius=0.1, sphere__position=(0, 0, 9), markers__springs=True,
            gripper={'names': ['left']},
        )
    )  # fmt: skip
    identities = MarkersMessage(cloth).identities
    assert len(identities) == len(MARKERS)
    message = deletion(identities, 'world')
    assert {(each.ns, each.id) for each in message.markers} == identities
    assert {each.action for each in message.markers} == {Marker.DELETE}
    assert {each.header.frame_id for each in message.markers} == {'world'}


def test_a_placeholder_that_is_missing_or_occurs_twice_is_an_error():
    message = cdr.SerializedMessage(deletion([('twice', 0), ('twice', 1)], 'world'))
    for placeholder in (b'twice', b'never'):
        with pytest.raises(AssertionError, match=r'placeholder found . times'):
            message.find(placeholder)
    with pytest.raises(AssertionError, match='length of the sequence'):
        cdr.SerializedMessage(deletion([('sixteen_of_bytes', 0)], '')).repeat(b'sixteen_', 3, 2)
