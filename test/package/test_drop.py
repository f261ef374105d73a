"""Benchmarks of contact: depth in a table or box, and the mesh that they write."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench import drop
from bench.test_contact import write_torus

HALF = drop.BOX_EDGE / 2


def flat(size: int, height: float) -> np.ndarray:
    line = np.linspace(-0.5, 0.5, size)
    x, y = np.meshgrid(line, line)
    return np.stack([x, y, np.full_like(x, height)], axis=-1)


@given(size=st.integers(2, 40), height=st.floats(-0.15, 0.15))
def test_a_flat_sheet_is_as_deep_as_it_is_low(size, height):
    sheet = flat(size, height)
    assert drop.depth(sheet, 'table') == pytest.approx(max(0.0, -height))
    # Above the middle of the box, where the upper face is the nearest one.
    small = sheet * (0.01, 0.01, 1.0)
    assert drop.depth(small, 'box') == pytest.approx(max(0.0, -height))
    assert drop.depth(small + np.array([0.6, 0.0, 0.0]), 'box') == 0


@given(reach=st.floats(0.01, 0.19))
def test_an_edge_of_the_box_enters_between_particles(reach):
    # All particles touch the surface: half of them the upper face, half of them a side.
    over = [[(HALF - reach, y, 0.0), (HALF, y, -reach)] for y in (-0.05, 0.05)]
    assert drop.depth(np.array(over), 'box') == pytest.approx(reach / 2)


@given(
    cell=st.lists(st.tuples(*[st.floats(-0.3, 0.3)] * 3), min_size=4, max_size=4),
    weights=st.tuples(*[st.floats(0, 1)] * 3),
)
def test_no_point_of_a_triangle_is_much_deeper_than_the_samples(cell, weights):
    corners = np.array(cell).reshape(2, 2, 3)
    shares = np.array(weights) + 1e-9
    shares /= shares.sum()
    longest = max(np.linalg.norm(a - b) for a in corners[0] for b in corners[1])
    longest = max(longest, *np.linalg.norm(corners[:, 0] - corners[:, 1], axis=-1))
    for middle in (corners[0, 1], corners[1, 0]):
        point = shares @ np.array([corners[0, 0], middle, corners[1, 1]])
        alone = np.broadcast_to(point, (2, 2, 3))
        # Six samples along a side: no point is further than a sixth of it from one of them.
        for support in drop.SUPPORTS:
            most = drop.depth(corners, support) + longest / 6
            assert drop.depth(alone, support) <= most + 1e-9


def test_what_is_not_held():
    assert drop.is_held(flat(4, 0.0))
    assert not drop.is_held(flat(4, -1.0))
    assert not drop.is_held(np.full((4, 4, 3), np.nan))


def test_stretch_of_a_stretched_sheet():
    assert drop.largest_stretch(flat(5, 0.0)) == pytest.approx(0)
    assert drop.largest_stretch(flat(5, 0.0) * (1.0, 1.25, 1.0)) == pytest.approx(0.25)


def test_the_torus_is_closed_and_its_normals_point_outwards(tmp_path):
    write_torus(tmp_path / 'torus.stl')
    content = (tmp_path / 'torus.stl').read_bytes()
    count = int(np.frombuffer(content, '<u4', 1, 80)[0])
    assert len(content) == 84 + 50 * count
    facets = np.frombuffer(content, [('v', '<f4', (4, 3)), ('a', '<u2')], count, 84)
    triangles = facets['v'][:, 1:].astype(float)
    edges = [
        (tuple(triangle[i]), tuple(triangle[(i + 1) % 3]))
        for triangle in triangles
        for i in range(3)
    ]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    volume = np.einsum('ij,ij', triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6
    assert volume == pytest.approx(2 * np.pi**2 * 0.2 * 0.1**2, rel=0.03)
