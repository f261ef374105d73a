"""Markers of colliders: what a viewer draws from them is the collider."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from builders import scene_of
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message
from rosbags.typesys import Stores, get_typestore
from visualization_msgs.msg import Marker, MarkerArray

from cloth_ros import Scene
from cloth_ros.messages.markers import MarkersMessage, deletion
from cloth_ros.scene.collider import ColliderParameters
from cloth_ros.scene.quaternion import rotation_matrix

TYPES = ('plane', 'sphere', 'box', 'capsule', 'cylinder', 'mesh')
STORE = get_typestore(Stores.ROS2_JAZZY)
GAP = 0.0005  # m, between a flat face and its marker
TETRAHEDRON = 0.1 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = TETRAHEDRON[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]


@dataclass
class Shape:
    """What markers read of a collider."""

    parameters: ColliderParameters
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    inset: float = 0.0

    @property
    def type(self) -> str:
        return self.parameters.type

    @property
    def mesh_triangles(self) -> np.ndarray | None:
        return FACES if self.type == 'mesh' else None


@dataclass
class Still:
    """A cloth at rest, with colliders."""

    scene: Scene
    colliders: dict[str, Shape]
    air_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    grippers: dict[str, object] = field(default_factory=dict)

    def write_positions(self, out: np.ndarray) -> None:
        out[...] = 0.0

    def write_particles(self, out: np.ndarray) -> None:
        out[...] = 0.0


def parameters_of(kind: str, name: str = 'it', **others: object) -> ColliderParameters:
    """Return the parameters of a collider; those that its type does not use are odd."""
    values = {
        'size': (0.2, 0.3, 0.4),
        'radius': 0.05,
        'length': 0.3,
        'mesh': '/with blank/tetra.stl',
        'position': (0.0, 0.0, 0.0),
        'orientation': (0.0, 0.0, 0.0, 1.0),
        'friction': 0.3,
        'frame_id': '',
    }
    return ColliderParameters(name=name, type=kind, **{**values, **others})


@st.composite
def shapes(draw: st.DrawFn, kinds: tuple[str, ...] = TYPES) -> Shape:
    """Draw a collider of any type in any pose, full size or shrunk."""
    number = st.floats(-2, 2)
    vector = np.array(draw(st.tuples(number, number, number, number)))
    if np.linalg.norm(vector) < 0.1:
        vector = np.array([0.5, -0.5, 0.5, 0.5])
    edge = st.floats(0.002, 0.5)
    parameters = parameters_of(
        draw(st.sampled_from(kinds)),
        size=draw(st.tuples(edge, edge, edge)),
        radius=draw(edge),
        length=draw(edge),
    )
    return Shape(
        parameters,
        position=draw(st.tuples(number, number, number)),
        orientation=tuple((vector / np.linalg.norm(vector)).tolist()),
        inset=draw(st.sampled_from([0.0, 0.001, 0.04, 10.0])),
    )


def drawn(*colliders: Shape, **parameters: object) -> list[Marker]:
    """Return the markers of colliders, the names of which are those of their parameters."""
    small = {'pins': [''], 'wind__air_density': 0.0, 'sheet__rows': 1, 'sheet__columns': 1}
    scene = scene_of(**small, **parameters)
    cloth = Still(scene, {each.parameters.name: each for each in colliders})
    message = MarkersMessage(cloth)
    first = {name: Shape(each.parameters, (9.0,) * 3, (1.0, 0.0, 0.0, 0.0), 0.01)
             for name, each in cloth.colliders.items()}  # fmt: skip
    message.serialise(Still(scene, first), 1, 1)  # the second state overwrites the first
    data = message.serialise(cloth, 5, 6)
    markers = [each for each in deserialize_message(data, MarkerArray).markers if each.ns in first]
    other = STORE.deserialize_cdr(data, 'visualization_msgs/msg/MarkerArray').markers
    for one, two in zip([each for each in other if each.ns in first], markers, strict=True):
        assert (one.ns, one.id, one.type, one.scale.y) == (two.ns, two.id, two.type, two.scale.y)
        assert len(one.points) == len(two.points)
    return markers


def placed(marker: Marker, points: np.ndarray) -> np.ndarray:
    """Return points of the unit shape of a marker as viewers place them, m, shape (count, 3)."""
    pose, scale = marker.pose, marker.scale
    q = pose.orientation
    turned = rotation_matrix((q.x, q.y, q.z, q.w))
    centre = (pose.position.x, pose.position.y, pose.position.z)
    return points * (scale.x, scale.y, scale.z) @ turned.T + centre


def directions(count: int = 200) -> np.ndarray:
    vectors = np.random.default_rng(1).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def surface(marker: Marker) -> np.ndarray:
    """Return points on the surface of a marker in the world, m, shape (count, 3)."""
    sphere = directions()
    if marker.type == Marker.SPHERE:
        unit = sphere / 2
    elif marker.type == Marker.CUBE:
        unit = sphere / np.abs(sphere).max(axis=1)[:, None] / 2
    elif marker.type == Marker.CYLINDER:
        mantle = sphere / np.hypot(*sphere.T[:2])[:, None] / 2
        mantle[:, 2] = sphere[:, 2] / 2
        cap = np.where([False, False, True], np.sign(sphere) / 2, sphere / 2)
        unit = np.concatenate([mantle, cap])
    else:
        unit = np.array([(each.x, each.y, each.z) for each in marker.points])
        assert (marker.scale.x, marker.scale.y, marker.scale.z) == (1.0, 1.0, 1.0)
    return placed(marker, unit)


def depth(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Return how deep points of the world are in a shape of full size, m; negative: outside."""
    local = (points - shape.position) @ rotation_matrix(shape.orientation)
    its = shape.parameters
    if shape.type == 'plane':
        return -local[:, 2]
    if shape.type == 'sphere':
        return its.radius - np.linalg.norm(local, axis=1)
    if shape.type == 'box':
        return (np.array(its.size) / 2 - np.abs(local)).min(axis=1)
    if shape.type == 'cylinder':
        return np.minimum(
            its.radius - np.hypot(*local.T[:2]), its.length / 2 - np.abs(local[:, 2])
        )
    if shape.type == 'capsule':
        along = np.clip(local[:, 2], -its.length / 2, its.length / 2)
        local[:, 2] -= along
        return its.radius - np.linalg.norm(local, axis=1)
    corners = TETRAHEDRON
    normals = np.array([[-1, 0, 0], [0, -1, 0], [0, 0, -1], np.full(3, 3**-0.5)])
    return -((local[:, None] - corners[[0, 0, 0, 1]]) * normals).sum(axis=2).max(axis=1)


@given(shape=shapes())
def test_viewers_accept_every_marker(shape):
    for marker in drawn(shape):
        q, scale = marker.pose.orientation, marker.scale
        assert np.linalg.norm((q.x, q.y, q.z, q.w)) == pytest.approx(1.0, abs=1e-9)
        assert min(scale.x, scale.y, scale.z) > 0
        assert marker.color.a == 1.0
        assert marker.action == Marker.ADD
        assert (marker.header.stamp.sec, marker.header.frame_id) == (5, 'world')
        assert bool(marker.points) == (marker.type == Marker.TRIANGLE_LIST)


@given(shape=shapes())
def test_what_is_drawn_lies_on_the_surface_of_the_collider(shape):
    shape.inset = 0.0
    markers = drawn(shape)
    depths = np.concatenate([depth(shape, surface(marker)) for marker in markers])
    assert depths.min() > -1e-9  # nothing of it is outside
    outer = np.concatenate([depth(shape, surface(each)) for each in markers[-2:]])
    assert outer.min() < GAP + 1e-9  # and it reaches the surface
    if shape.type in ('sphere', 'mesh'):
        assert depths.max() < 1e-9  # everywhere
    elif shape.type in ('box', 'cylinder'):
        assert depths.max() < GAP + 1e-9
    elif shape.type == 'capsule':  # both ends, and the mantle between them
        ends = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5]])
        tips = np.concatenate([placed(ball, ends) for ball in markers[1:]])
        along = (tips - shape.position) @ rotation_matrix(shape.orientation)[:, 2]
        reach = shape.parameters.length / 2 + shape.parameters.radius
        assert (along.min(), along.max()) == pytest.approx((-reach, reach))
        side = placed(markers[0], np.array([[0.5, 0.0, 0.0], [0.0, 0.5, 0.49]]))
        assert np.abs(depth(shape, side)).max() < 1e-9


@given(shape=shapes())
def test_a_shape_that_grows_is_drawn_within_its_full_size(shape):
    for marker in drawn(shape):
        assert depth(shape, surface(marker)).min() > -1.5e-6  # m, of the least scale


@pytest.mark.parametrize('kind', TYPES)
def test_a_shape_that_grows_is_drawn_smaller(kind):
    small, large = (
        Shape(parameters_of(kind), (1.0, 2.0, 3.0), (0.5, 0.5, -0.5, 0.5), inset)
        for inset in (0.02, 0.0)
    )
    shrunk, full = drawn(small), drawn(large)
    mean = [depth(large, np.concatenate([surface(each) for each in markers])).mean()
            for markers in (shrunk, full)]  # fmt: skip
    assert 0.002 < mean[0] - mean[1] < 0.021
    if kind != 'mesh':  # which is scaled down
        nearest = min(depth(large, surface(each)).min() for each in shrunk)
        assert 0.02 - 1e-9 < nearest < 0.02 + GAP + 1e-9


@given(shape=shapes(('plane',)), place=st.tuples(*[st.floats(-20, 20)] * 3))
def test_a_plane_reaches_past_the_sheet(shape, place):
    shape.inset = 0.0
    (marker,) = drawn(shape, sheet__position=place, sheet__size=(1.5, 0.5))
    normal = rotation_matrix(shape.orientation)[:, 2]
    foot = np.array(place) - normal * (normal @ (np.array(place) - shape.position))
    about = foot + 1.4 * directions() @ (np.eye(3) - np.outer(normal, normal))
    unit = (about - placed(marker, np.zeros((1, 3)))) @ rotation_matrix(shape.orientation)
    inside = np.abs(unit) <= np.array([marker.scale.x, marker.scale.y, np.inf]) / 2
    assert inside.all()


def test_a_mesh_is_drawn_by_its_file_if_that_is_wanted():
    still, grows = (
        Shape(parameters_of('mesh'), (1.0, 2.0, 3.0), (0.5, 0.5, -0.5, 0.5), inset)
        for inset in (0.0, 0.02)
    )
    by_triangles, by_file = {}, {}
    for shape in (still, grows):
        (by_triangles[shape.inset],) = drawn(shape)
        (marker,) = drawn(shape, markers__meshes='file')
        assert marker.type == Marker.MESH_RESOURCE
        assert marker.mesh_resource == 'file:///with%20blank/tetra.stl'
        by_file[shape.inset] = placed(marker, FACES.reshape(-1, 3))
        np.testing.assert_allclose(by_file[shape.inset], surface(by_triangles[shape.inset]))
    assert np.ptp(by_file[0.02], axis=0) == pytest.approx(0.6 * np.ptp(by_file[0.0], axis=0))


def test_every_marker_has_an_identity_of_its_own():
    poses = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    names = {'capsule': 'link', 'box': 'table', 'plane': 'floor'}
    shapes = [Shape(parameters_of(kind, name), *poses) for kind, name in names.items()]
    scene = scene_of(pins=['0,0'], sheet__rows=2, sheet__columns=2)
    cloth = Still(scene, {each.parameters.name: each for each in shapes})
    message = MarkersMessage(cloth)
    markers = deserialize_message(message.serialise(cloth, 1, 1), MarkerArray).markers
    identities = [(each.ns, each.id) for each in markers]
    assert sorted(identities) == sorted(message.identities)
    assert [number for name, number in identities if name == 'link'] == [0, 1, 2]
    gone = message.identities - MarkersMessage(Still(cloth.scene, {})).identities
    assert {(each.ns, each.id) for each in deletion(gone, 'world').markers} == gone
    assert {name for name, _ in gone} == set(names.values())
