"""The same sheet in other engines; those that are not installed are skipped."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from cloth_ros import Cloth

from .sheets import scene

ENGINES = ('numpy_slices', 'taichi_explicit', 'mujoco_flex', 'newton_vbd', 'pybullet_soft')
# Sizes for engines other than `DEFAULT_SIZES`, which keep the duration below minutes.
DEFAULT_SIZES = (16, 32, 64)
SIZES = {'numpy_slices': (16, 32, 64, 128), 'taichi_explicit': (16, 32, 64, 128)}
_TICK = 1 / 60


def largest_strain(positions: np.ndarray) -> float:
    """Return the largest strain between neighbours along rows and columns."""
    rest = 1 / (len(positions) - 1)
    along = np.linalg.norm(np.diff(positions, axis=0), axis=-1)
    across = np.linalg.norm(np.diff(positions, axis=1), axis=-1)
    return float(max(np.abs(along / rest - 1).max(), np.abs(across / rest - 1).max()))


@pytest.mark.parametrize('size', [16, 32, 64, 128])
def test_cloth_ros(benchmark, size):
    """Cloth of this package, with automatic substeps."""
    cloth = Cloth(scene(size))
    cloth.advance(_TICK)
    benchmark.pedantic(lambda: cloth.advance(_TICK), rounds=60, iterations=1)
    cloth.reset()
    cloth.advance(1.0)
    benchmark.extra_info.update(
        table='engine',
        engine='cloth_ros',
        size=size,
        particle_steps=size * size * cloth.substeps / 60,
        strain=largest_strain(cloth.positions),
        settings=f'{round(_TICK / cloth.substep)} substeps a tick, chosen for 1 mm',
    )


@pytest.mark.parametrize('size', [16, 32, 64, 128])
@pytest.mark.parametrize('name', ENGINES)
def test_engine(benchmark, name, size):
    """Another engine, with the fastest setting found; see its module."""
    if size not in SIZES.get(name, DEFAULT_SIZES):
        pytest.skip('takes minutes')
    engine = importlib.import_module(f'.engines.{name}', __package__)
    try:
        version = engine.version()
        sheet = engine.Sheet(size)
    except ImportError as error:
        pytest.skip(f'{engine.NAME} is not installed: {error}')
    sheet.advance()
    benchmark.pedantic(sheet.advance, rounds=59, iterations=1)
    information = {
        'table': 'engine',
        'engine': f'{engine.NAME} {version}',
        'size': size,
        'strain': largest_strain(sheet.positions()),
        'settings': sheet.settings,
    }
    if hasattr(sheet, 'substeps'):
        information['particle_steps'] = size * size * sheet.substeps
    benchmark.extra_info.update(information)
