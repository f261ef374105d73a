"""What is sent of a sheet, by a real server without a browser."""

from collections.abc import Iterator

import numpy as np
import pytest
import viser

from cloth_ros.viewer.options import Options, free_address
from cloth_ros.viewer.particles import Sheet
from cloth_ros.viewer.sheet_view import COLOURINGS, SheetView


@pytest.fixture
def view() -> Iterator[SheetView]:
    address = free_address(Options('localhost', 0, []))
    server = viser.ViserServer(host=address.host, port=address.port, verbose=False)
    yield SheetView(server.scene, '/sheet')
    server.stop()


def sheet(side: int) -> Sheet:
    y, x = np.mgrid[0:side, 0:side] / np.float32(side - 1)
    positions = np.stack([x, y, 0 * x], -1).astype(np.float32)
    return Sheet(0.0, 'world', positions, positions)


def vertices(view: SheetView) -> list[int]:
    return [len(mesh.vertices) for mesh in view._meshes]


def test_of_large_sheets_rows_and_columns_are_left_out_unless_all_are_wanted(view):
    view.draw(sheet(40))
    assert not view.is_large
    assert vertices(view) == [1600, 1600]
    view.draw(sheet(128))
    assert view.is_large
    assert vertices(view) == [65 * 65, 65 * 65]
    for mesh in view._meshes:
        assert mesh.faces.max() == 65 * 65 - 1
        np.testing.assert_array_equal(mesh.vertices.max(0), (1, 1, 0))  # as far as the edges
    view.every_particle = True
    assert view.is_empty
    view.draw(sheet(128))
    assert vertices(view) == [128 * 128, 128 * 128]


@pytest.mark.parametrize('name', COLOURINGS)
def test_colours_cover_a_large_sheet(view, name):
    view.colouring = name
    view.draw(sheet(128))
    area = 0.0
    for mesh in view._meshes:
        corners = mesh.vertices[mesh.faces]
        sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area += np.linalg.norm(np.cross(*sides), axis=-1).sum() / 2
    assert area == pytest.approx(1.0)
