"""
Cost of a substep in contact: a free sheet that lies on a collider, or falls on it.

The colliders have their highest point at z = 0, and there is nothing below them.  The cost without
contact is that of the same sheet that hangs from two corners, measured just before.
"""

from __future__ import annotations

import math
import os
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.model.snapshot import Snapshot

from .sheets import scene

SIZES = (32, 64, 128, 256)
# Sheets from 64 × 64 on share threads.
THREADS = [1, 2] if (os.cpu_count() or 1) > 1 else [1]
_TICK = 1 / 60
# Of hanging and lying sheets, 1/s, so that these come to rest.
_DRAG = 2.0
# Where lying sheets start, m above the collider; how long they settle, s, on a grid of at most
# this size and then on their own.
_START = 0.01
_SETTLING = 1.0
_COARSE = 64
_SETTLING_ON_GRID = 0.05
# Speed at which falling sheets arrive, m/s.
_FALL = 1.0

# Main and small radius of the mesh, a torus, m.
_TORUS = (0.2, 0.1)
# Along x instead of z.
_LYING = [0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)]

SHAPES: dict[str, dict[str, object]] = {
    'plane': {'type': 'plane'},
    'sphere': {'type': 'sphere', 'radius': 0.3, 'position': [0.0, 0.0, -0.3]},
    'box': {'type': 'box', 'size': [0.4, 0.4, 0.4], 'position': [0.0, 0.0, -0.2]},
    'capsule': {
        'type': 'capsule',
        'radius': 0.15,
        'length': 0.4,
        'position': [0.0, 0.0, -0.15],
        'orientation': _LYING,
    },
    'cylinder': {
        'type': 'cylinder',
        'radius': 0.2,
        'length': 0.4,
        'position': [0.0, 0.0, -0.2],
    },
    'mesh': {'type': 'mesh', 'position': [0.0, 0.0, -_TORUS[1]]},
}
STATES = ('hanging', *(f'{how} {shape}' for how in ('lying', 'falling') for shape in SHAPES))
# States of a size and number of threads follow each other, the hanging sheet first.
CASES = [
    (size, threads, state)
    for size in SIZES
    for threads in THREADS
    if threads == 1 or size >= 64
    for state in STATES
]


def write_torus(path: Path, around: int = 48, across: int = 24) -> None:
    """Write a torus around the z axis, of the radii `_TORUS`, as a binary STL file."""
    u, v = np.meshgrid(
        np.arange(around + 1) * (2 * math.pi / around),
        np.arange(across + 1) * (2 * math.pi / across),
        indexing='ij',
    )
    distance = _TORUS[0] + _TORUS[1] * np.cos(v)
    grid = np.stack([distance * np.cos(u), distance * np.sin(u), _TORUS[1] * np.sin(v)], axis=-1)
    # The last row and column are the first ones again, to the bit, so that the mesh is closed.
    grid[-1], grid[:, -1] = grid[0], grid[:, 0]
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    triangles = np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 3)
    facets = np.zeros(
        len(triangles),
        [('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('attribute', '<u2')],
    )
    facets['corners'] = triangles
    header = b'torus'.ljust(80)
    path.write_bytes(header + np.uint32(len(facets)).tobytes() + facets.tobytes())


@pytest.fixture(scope='module')
def mesh_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of an STL file with a torus."""
    path: Path = tmp_path_factory.mktemp('mesh') / 'torus.stl'
    write_torus(path)
    return path


def scene_of(state: str, size: int, mesh: Path, threads: int = 1) -> Scene:
    """Return the scene of one of `STATES`, single precision."""
    changes: dict[str, object] = {'drag': _DRAG, 'solver__threads': threads}
    if state != 'hanging':
        how, shape = state.split()
        parameters = {**SHAPES[shape], 'friction': 0.5}
        if shape == 'mesh':
            parameters['mesh'] = str(mesh)
        changes |= {f'collider__support__{name}': value for name, value in parameters.items()}
        changes |= {'collider__names': ['support'], 'pins': ['']}
        changes['sheet__position'] = [0.0, 0.0, _START]
        if how == 'falling':
            # The thickness of a sheet in contact may be half the diagonal of a cell.
            height = 0.005 + math.sqrt(0.5) / (size - 1)
            changes |= {'drag': 0.0, 'sheet__position': [0.0, 0.0, height]}
    return scene(size, **changes)


def _lying(state: str, size: int, mesh: Path) -> Snapshot:
    """Return a sheet at rest, prepared on a coarse grid."""
    coarse = Cloth(scene_of(state, min(size, _COARSE), mesh))
    coarse.advance(_SETTLING)
    cloth = Cloth(scene_of(state, size, mesh))
    cloth.restore(coarse.snapshot())
    cloth.advance(_SETTLING_ON_GRID)
    return cloth.snapshot()


def _falling(state: str, size: int, mesh: Path) -> Snapshot:
    """Return a sheet that has just touched the collider."""
    cloth = Cloth(scene_of(state, size, mesh))
    cloth.velocities = np.broadcast_to([0.0, 0.0, -_FALL], (size, size, 3))
    for _ in range(100):
        cloth.advance(5e-4)
        # Without contact, all particles become faster.
        if cloth.velocities[..., 2].max() > -0.95 * _FALL:
            return cloth.snapshot()
    raise AssertionError(f'a sheet of {size} × {size} did not touch: {state}')


@cache
def prepared(state: str, size: int, mesh: Path) -> Snapshot:
    """Return a sheet in one of `STATES`; the same for every number of threads."""
    if state == 'hanging':
        return Cloth(scene_of(state, size, mesh)).snapshot()
    return (_lying if state.startswith('lying') else _falling)(state, size, mesh)


@pytest.mark.parametrize(('size', 'threads', 'state'), CASES)
def test_contact(benchmark: Any, mesh_file: Path, size: int, threads: int, state: str) -> None:
    """Ticks of a hanging or lying sheet, or the tick in which a falling one has its impact."""
    cloth = Cloth(scene_of(state, size, mesh_file, threads))
    snapshot = prepared(state, size, mesh_file)
    cloth.restore(snapshot)
    cloth.advance(_TICK)
    substeps = []

    def again() -> None:
        cloth.restore(snapshot)
        # What is prepared after a restore is not part of the time.
        cloth.advance(1e-3)

    def tick() -> None:
        cloth.advance(_TICK)
        substeps.append(cloth.substeps)

    # Half a second in total, but enough rounds for a median.
    once = 5e-9 * size**2 * cloth.substeps
    benchmark.pedantic(
        tick,
        setup=again if state.startswith('falling') else None,
        rounds=max(5, min(100, int(0.5 / once))),
        warmup_rounds=1,
    )
    # A sheet that has slipped off, or fallen through, is not in contact.
    assert cloth.positions[..., 2].mean() > -0.5
    benchmark.extra_info.update(
        table='contact',
        state=state,
        size=size,
        threads=threads,
        steps=size**2 * float(np.median(substeps)),
    )
