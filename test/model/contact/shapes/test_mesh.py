"""Meshes from files: what is read, and what is refused with one clear line."""

import numpy as np
import pytest
from builders import run_python
from meshes import SOLIDS, angle_section, ascii_stl, binary_stl, box, obj, sphere

from cloth_ros.model.contact.shapes import mesh
from cloth_ros.model.contact.shapes.mesh import closed_mesh, load_mesh, winding_number

BOX = box(0.3, 0.2, 0.1)


def volume(found: mesh.Mesh) -> float:
    a, b, c = np.moveaxis(found.corners, 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6)


@pytest.mark.parametrize(
    ('name', 'content', 'tolerance'),
    [
        ('box.stl', binary_stl(BOX), 1e-8),
        ('BOX.STL', ascii_stl(BOX).encode(), 0),
        ('box.obj', obj(BOX).encode(), 0),
        ('quads.obj', b'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n'
         b'f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n', 0),
    ],
)  # fmt: skip
def test_formats(tmp_path, name, content, tolerance):
    path = tmp_path / name
    path.write_bytes(content)
    found = load_mesh(str(path))
    assert len(found.vertices) == 8
    assert len(found.triangles) == 12
    if 'quads' not in name:
        assert found.upper == pytest.approx((0.15, 0.1, 0.05), abs=tolerance)
        assert volume(found) == pytest.approx(0.3 * 0.2 * 0.1, rel=1e-6)
    assert load_mesh(f'file://{path}').digest == found.digest


def test_scipy_is_not_needed(tmp_path):
    (tmp_path / 'box.stl').write_bytes(binary_stl(BOX))
    (tmp_path / 'box.obj').write_text(obj(BOX))
    done = run_python(
        'import sys; sys.modules["scipy"] = None\n'
        'from cloth_ros.model.contact.shapes import mesh\n'
        'assert "trimesh" not in sys.modules\n'
        'for path in sys.argv[1:]: print(len(mesh.load_mesh(path).triangles))',
        tmp_path / 'box.stl',
        tmp_path / 'box.obj',
    )
    assert (done.stdout.split(), done.stderr) == (['12', '12'], '')


def test_packages_are_found_without_ros(tmp_path, monkeypatch):
    share = tmp_path / 'share' / 'robot'
    (share / 'meshes').mkdir(parents=True)
    (share / 'package.xml').touch()
    (share / 'meshes' / 'box.stl').write_bytes(binary_stl(BOX))
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nowhere:{tmp_path}')
    assert len(load_mesh('package://robot/meshes/box.stl').triangles) == 12
    with pytest.raises(ValueError, match='package that is installed; source the workspace'):
        load_mesh('package://other/meshes/box.stl')


def test_inside_out_is_turned():
    found = closed_mesh(BOX[:, ::-1])
    assert volume(found) == pytest.approx(0.006)
    shell = np.concatenate([BOX, box(0.2, 0.1, 0.05)[:, ::-1]])
    beside = np.concatenate([BOX, box(0.1, 0.1, 0.1)[:, ::-1] + 0.4])
    for corners, expected in ((shell, 0.005), (shell[:, ::-1], 0.005), (beside, 0.007)):
        assert volume(closed_mesh(corners)) == pytest.approx(expected)


def test_bodies_may_touch_in_an_edge():
    cube = box(0.1, 0.1, 0.1)
    found = closed_mesh(np.concatenate([cube, cube + np.array([0.1, 0.1, 0])]))
    assert len(found.vertices) == 14
    assert volume(found) == pytest.approx(0.002)


def test_slivers_have_the_normal_of_a_neighbour():
    # The middle of an edge is a corner of a triangle on one side, joined by a sliver.
    a, b, c, d = np.array([[0.0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]])
    m = (a + b) / 2
    corners = np.array([[a, c, m], [m, c, b], [a, m, b], [a, b, d], [a, d, c], [b, c, d]])
    found = closed_mesh(corners)
    normals = found.normals()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1)
    a, b, c = np.moveaxis(found.corners, 1, 0)
    sliver = np.linalg.norm(np.cross(b - a, c - a), axis=1).argmin()
    assert np.delete(normals, sliver, 0).tolist().count(normals[sliver].tolist()) >= 1


def test_winding_number():
    corners = SOLIDS['L'].corners
    assert winding_number(corners, np.array([0.02, 0.1, 0])) == pytest.approx(1)
    assert winding_number(corners, np.array([0.06, 0.06, 0])) == pytest.approx(0, abs=1e-12)


NOT_FINITE = BOX.copy()
NOT_FINITE[3, 1, 2] = np.nan


@pytest.mark.parametrize(
    ('corners', 'expected'),
    [
        (BOX[:0], 'none can be read; export'),
        (NOT_FINITE, 'finite coordinates; export'),
        (BOX[1:], 'closed mesh, and 3 edges have a triangle on one side only; close'),
        (np.concatenate([BOX[1:], BOX[:1, ::-1]]), 'at 3 edges they disagree; make its normals'),
        (1000 * BOX, 'not 300 × 200 × 100 m; if it is in millimetres, scale it by 0.001'),
        (1e-3 * BOX, 'not 0.0003 × 0.0002 × 0.0001 m; export it again in metres'),
        (BOX + 1e4, 'and 1e+04 m from its origin'),
        (np.concatenate([BOX[:1], BOX[:1, ::-1]]), 'encloses a volume; give it a thickness'),
        (BOX[:, [0, 0, 1]], 'all triangles are degenerate; repair it'),
        (np.zeros((mesh.MAX_TRIANGLES + 1, 3, 3)), 'at most 200000 triangles, not of 200001'),
    ],
)
def test_unusable_meshes_are_refused(corners, expected):
    with pytest.raises(
        ValueError, match=r"^collider\.a\.mesh is 'a\.stl', but must be "
    ) as caught:
        closed_mesh(corners, 'collider.a.mesh', 'a.stl')
    assert expected in str(caught.value)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    ('name', 'content', 'expected'),
    [
        ('none.stl', None, 'No such file or directory'),
        ('mesh.dae', b'', 'a file .stl or .obj; export'),
        ('empty.stl', b'', 'none can be read'),
        ('junk.stl', bytes(range(256)) * 10, 'none can be read'),
        ('cut.stl', binary_stl(BOX)[:-7], 'none can be read'),
        ('junk.obj', b'v 1 2\nf 1 2 3\n', 'OBJ'),
        ('index.obj', b'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n', 'OBJ'),
        ('points.obj', b'v 0 0 0\nv 1 0 0\nv 0 1 0\n', 'none can be read'),
        ('folder.obj', 'folder', 'Is a directory'),
        ('nul\0.stl', None, 'embedded null'),
    ],
)
def test_unusable_files_are_refused(tmp_path, name, content, expected):
    path = tmp_path / name
    if content == 'folder':
        path.mkdir()
    elif content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=r'^mesh is .*, but must be .*; ') as caught:
        load_mesh(str(path))
    assert expected in str(caught.value)
    assert '\n' not in str(caught.value)


def test_huge_files_and_other_urls_are_refused(tmp_path, monkeypatch):
    path = tmp_path / 'box.stl'
    path.write_bytes(binary_stl(BOX))
    with pytest.raises(ValueError, match='a path, file://… or package://…'):
        load_mesh('https://example.org/box.stl')
    monkeypatch.setattr(mesh, 'MAX_FILE_SIZE', 600)
    with pytest.raises(ValueError, match='not of 0 MB; simplify it'):
        load_mesh(str(path))


def test_bounding_radius():
    assert closed_mesh(sphere(0.1, 20)).bounding_radius() == pytest.approx(0.1)
    moved = closed_mesh(angle_section(0.3, 0.1, 0.2))
    assert moved.bounding_radius() == pytest.approx(np.sqrt(0.3**2 + 0.1**2 + 0.1**2))
