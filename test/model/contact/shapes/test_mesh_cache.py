"""Distance grids on disk."""

import os
from pathlib import Path

import numpy as np
import pytest
from meshes import SOLIDS

from cloth_ros.model.contact.shapes import mesh_cache
from cloth_ros.model.contact.shapes.mesh_cache import cache_folder, cached_distance_grid

RHO = 0.014


@pytest.fixture
def made(monkeypatch):
    """The cells of the grids that were made, not loaded."""
    cells = []
    make = mesh_cache.distance_grid

    def recorded(mesh, cell, rho):
        cells.append(cell)
        return make(mesh, cell, rho)

    monkeypatch.setattr(mesh_cache, 'distance_grid', recorded)
    return cells


def grid_of(folder, name='box', cell=0.01, rho=RHO):
    return cached_distance_grid(SOLIDS[name], cell, rho, folder)


def test_a_grid_is_made_once(tmp_path, made):
    first, second = grid_of(tmp_path / 'new'), grid_of(tmp_path / 'new')
    assert made == [0.01]
    for name in ('values', 'share', 'origin'):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
        assert getattr(first, name).dtype == getattr(second, name).dtype
    assert (first.cell, first.rho, first.error) == (second.cell, second.rho, second.error)
    grid_of(tmp_path / 'new', name='L')
    grid_of(tmp_path / 'new', cell=0.011)
    grid_of(tmp_path / 'new', rho=0.013)
    assert made == [0.01, 0.01, 0.011, 0.01]
    assert not list((tmp_path / 'new').glob('*.part'))


def test_damaged_files_are_replaced(tmp_path, made):
    expected = grid_of(tmp_path)
    (path,) = tmp_path.iterdir()
    content = path.read_bytes()
    flipped = bytearray(content)
    flipped[len(content) // 3] ^= 1
    for damaged in (b'', b'junk', content[: len(content) // 2], bytes(flipped)):
        path.write_bytes(damaged)
        assert grid_of(tmp_path).values.tobytes() == expected.values.tobytes()
        assert path.read_bytes() == content
    np.savez(path.open('wb'), values=np.zeros(3))
    assert grid_of(tmp_path).share.tobytes() == expected.share.tobytes()
    assert len(made) == 6


def test_no_folder_and_no_room_are_no_errors(tmp_path, made, monkeypatch):
    (tmp_path / 'file').touch()
    assert grid_of(tmp_path / 'file' / 'below').values.size > 1000

    def full(*arguments, **channels):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(mesh_cache.np, 'savez', full)
    assert grid_of(tmp_path).values.size > 1000
    assert [path.name for path in tmp_path.iterdir()] == ['file']
    assert len(made) == 2


def test_old_files_are_removed(tmp_path, monkeypatch):
    grid_of(tmp_path)
    (old,) = tmp_path.iterdir()
    os.utime(old, (1, 1))
    monkeypatch.setattr(mesh_cache, 'MAX_SIZE', old.stat().st_size)
    grid_of(tmp_path, cell=0.011)
    (kept,) = tmp_path.iterdir()
    assert kept != old


def test_folder(monkeypatch):
    monkeypatch.setenv('NUMBA_CACHE_DIR', '/a')
    monkeypatch.setenv('XDG_CACHE_HOME', '/b')
    assert cache_folder() == Path('/a/cloth_ros')
    monkeypatch.delenv('NUMBA_CACHE_DIR')
    assert cache_folder() == Path('/b/cloth_ros')
    monkeypatch.delenv('XDG_CACHE_HOME')
    monkeypatch.setenv('HOME', '/home/me')
    assert cache_folder() == Path('/home/me/.cache/cloth_ros')
