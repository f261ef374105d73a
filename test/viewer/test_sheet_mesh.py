"""Triangles, strain and colours of a sheet."""

import numpy as np
import pytest

from cloth_ros.viewer.colour_scale import ColourScale, round_up
from cloth_ros.viewer.sheet_mesh import (
    cell_speed,
    cell_stretch,
    every,
    largest_of_cells,
    split_by_level,
    triangles,
)


def flat(rows, columns):
    y, x = np.mgrid[0:rows, 0:columns]
    return np.stack([x, y, 0 * x], -1).astype(np.float32)


def test_triangles_cover_the_sheet_once_and_face_its_normal():
    points = flat(4, 6)
    corners = points.reshape(-1, 3)[triangles(4, 6).reshape(-1, 3)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normal, np.tile([0, 0, 1], (30, 1)))
    assert normal[:, 2].sum() / 2 == 3 * 5


def test_stretch_is_that_of_the_longest_edge_and_not_negative():
    points = flat(3, 4)
    points[:, 2:, 0] += 0.5  # between the second and the third column
    stretch = cell_stretch(points, (1.0, 1.0))
    np.testing.assert_allclose(stretch, np.tile([0, 0.5, 0], (2, 1)), atol=1e-6)
    assert not cell_stretch(points, (2.0, 2.0)).any()


def test_speed_is_the_mean_of_the_corners():
    velocities = np.zeros((2, 2, 3), np.float32)
    velocities[0, 0] = 3.0, 4.0, 0.0
    assert cell_speed(velocities) == pytest.approx(5 / 4)


def test_parts_of_all_levels_are_the_sheet():
    points, cells = flat(5, 7), triangles(5, 7)
    values = np.arange(24, dtype=np.float32).reshape(4, 6)
    parts = split_by_level(points, cells, values, 20.0, 4)
    area = []
    for part in parts:
        corners = part.vertices[part.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area.append(normal[:, 2].sum() / 2)
    assert area == [5, 5, 5, 9]  # of values below 5, 10, 15; the last level has what is above
    assert split_by_level(points, cells, values + 5, 100.0, 4)[3] is None


@pytest.mark.parametrize('step', [1, 2, 3, 10])
@pytest.mark.parametrize('shape', [(2, 9), (8, 7)])
def test_rows_and_columns_are_left_out_but_no_edge_and_no_large_value(shape, step):
    rows, columns = (every(count, step) for count in shape)
    assert (rows[0], rows[-1], columns[-1]) == (0, shape[0] - 1, shape[1] - 1)
    assert np.diff(columns).max() <= step
    values = np.arange((shape[0] - 1) * (shape[1] - 1), dtype=np.float32)
    largest = largest_of_cells(values.reshape(shape[0] - 1, shape[1] - 1), step)
    assert largest.shape == (len(rows) - 1, len(columns) - 1)
    assert largest.max() == values.max()
    assert (largest[0, 0] == 0) == (step == 1)


@pytest.mark.parametrize(('value', 'rounded'), [(0.3, 0.5), (1.0, 1.0), (2.1, 5.0), (70, 100)])
def test_scales_end_at_round_values(value, rounded):
    assert round_up(value) == pytest.approx(rounded)


def test_a_scale_grows_at_once_and_shrinks_later():
    scale = ColourScale(0.1)
    assert scale.follow(3.0)
    assert scale.greatest == 5.0
    changes = [scale.follow(0.3) for _ in range(200)]
    assert sum(changes) == 1
    assert not any(changes[:30])
    assert scale.greatest == 0.5
