"""Triangle lists as RViz and Foxglove need them: complete, lit, front faces outwards."""

import numpy as np
import pytest
from builders import cloth_of
from geometry_msgs.msg import Point
from meshes import binary_stl, sphere
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import Marker, MarkerArray

from cloth_ros.messages.markers import MarkersMessage
from cloth_ros.scene.quaternion import rotation_matrix

TURNS = {
    'flat': (0.0, 0.0, 0.0, 1.0),
    'upright': (-(0.5**0.5), 0.0, 0.0, 0.5**0.5),
    'oblique': (0.5, 0.1, -0.3, 0.8062257748),
}


def vector(point: Point) -> tuple[float, float, float]:
    return point.x, point.y, point.z


def triangle_lists(cloth) -> dict[str, Marker]:
    data = MarkersMessage(cloth).serialise(cloth, 1, 1)
    markers = deserialize_message(data, MarkerArray).markers
    return {each.ns: each for each in markers if each.type == Marker.TRIANGLE_LIST}


def corners_and_normals(marker: Marker) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners, shape (count, 3, 3), and the cross products of edges, (count, 3)."""
    corners = np.array([vector(each) for each in marker.points]).reshape(-1, 3, 3)
    edges = corners[:, 1:] - corners[:, :1]
    return corners, np.cross(edges[:, 0], edges[:, 1])


@pytest.mark.parametrize('turn', TURNS.values(), ids=TURNS.keys())
def test_triangle_lists_are_lit_complete_and_face_outwards(turn, tmp_path):
    path = tmp_path / 'ball.stl'
    path.write_bytes(binary_stl(sphere(0.2, 12)))
    cloth = cloth_of(
        sheet__rows=5,
        sheet__columns=4,
        sheet__size=(1.5, 0.8),
        sheet__orientation=turn,
        collider__names=['ball'],
        collider__ball__type='mesh',
        collider__ball__mesh=str(path),
        collider__ball__position=(0.0, 0.0, 5.0),
    )
    lists = triangle_lists(cloth)
    assert set(lists) == {'sheet', 'ball'}
    for marker in lists.values():
        assert marker.points
        assert len(marker.points) % 3 == 0
        assert not marker.colors  # RViz draws triangles with colours of their own without light
        assert not marker.texture.data
        assert vector(marker.scale) == (1.0, 1.0, 1.0)
        _, normals = corners_and_normals(marker)
        assert np.linalg.norm(normals, axis=1).min() > 1e-6  # m², twice the least area
    _, normals = corners_and_normals(lists['sheet'])
    cell = 1.5 / 3 * 0.8 / 4
    up = rotation_matrix(tuple(np.array(turn) / np.linalg.norm(turn)))[:, 2]
    np.testing.assert_allclose(normals, np.tile(cell * up, (2 * 4 * 3, 1)), atol=1e-6)
    corners, normals = corners_and_normals(lists['ball'])
    outwards = corners.mean(axis=1)  # its origin is its centre
    assert (np.einsum('ij,ij->i', outwards, normals) > 0).all()
