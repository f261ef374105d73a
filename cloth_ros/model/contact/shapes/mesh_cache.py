"""Distance grids on disk: each is made once for a mesh, a cell and a sheet."""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
import uuid
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np

from .distance_grid import DistanceGrid, distance_grid, largest_radius
from .mesh import Mesh

# Bytes of all files together; the oldest are removed.
MAX_SIZE = 500_000_000
_CHANNELS = ('values', 'share', 'origin', 'cell', 'rho', 'error')


@functools.cache
def _sources() -> str:
    """Return a hash of the code that a grid depends on."""
    digest = hashlib.sha256(np.__version__.encode())
    for path in sorted(Path(__file__).parent.glob('*.py')):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def cache_folder() -> Path:
    """
    Return the folder of the cached grids; it may not exist.

    In `NUMBA_CACHE_DIR`, where the kernels are cached too, if that is set; otherwise in
    `XDG_CACHE_HOME`, by default ``~/.cache``.
    """
    if folder := os.environ.get('NUMBA_CACHE_DIR') or os.environ.get('XDG_CACHE_HOME'):
        return Path(folder).absolute() / 'cloth_ros'
    try:
        return Path.home() / '.cache' / 'cloth_ros'
    except RuntimeError:  # no home
        return Path(tempfile.gettempdir()) / f'cloth_ros-{os.getuid()}'


def _load(path: Path, cell: float, rho: float) -> DistanceGrid | None:
    """Return a grid from a file, None if there is none or it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in _CHANNELS}
        grid = DistanceGrid(
            found['values'],
            found['share'],
            found['origin'],
            float(found['cell']),
            float(found['rho']),
            float(found['error']),
        )
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error):
        return None
    channels = (grid.values, grid.share)
    if (grid.cell, grid.rho) != (
        cell,
        largest_radius(cell, rho),
    ) or grid.values.shape != grid.share.shape:
        return None
    whole = all(each.dtype == np.float32 and each.ndim == 3 for each in channels)
    return grid if whole and grid.origin.shape == (3,) else None


def _save(path: Path, grid: DistanceGrid) -> None:
    """Write a grid; the file appears whole, also beside other processes, or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(f'.{uuid.uuid4().hex}.part')
    try:
        with draft.open('wb') as file:
            np.savez(file, **{name: getattr(grid, name) for name in _CHANNELS})
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)
    files = [(each.stat(), each) for each in path.parent.glob('*.npz')]
    total = 0
    for status, each in sorted(files, key=lambda one: -one[0].st_mtime_ns):
        total += status.st_size
        if total > MAX_SIZE and each != path:
            each.unlink(missing_ok=True)


def cached_distance_grid(
    mesh: Mesh, cell: float, rho: float, folder: Path | None = None
) -> DistanceGrid:
    """
    Return the distance grid of a mesh from the cache, or make it and cache it.

    A cache that cannot be read or written is no error: the grid is then made again.

    Parameters
    ----------
    mesh, cell, rho
        See `distance_grid`.
    folder
        Of the cache; None for `cache_folder`.

    Raises
    ------
    ValueError
        As `distance_grid` does.

    """
    cell, rho = float(cell), float(rho)
    key = f'{_sources()} {mesh.digest} {cell.hex()} {rho.hex()}'
    name = hashlib.sha256(key.encode()).hexdigest()[:20]
    path = (cache_folder() if folder is None else folder) / f'{name}.npz'
    grid = _load(path, cell, rho)
    if grid is None:
        grid = distance_grid(mesh, cell, rho)
        with suppress(OSError):
            _save(path, grid)
    return grid
