"""The same sheet in other engines, hanging and dropped; those not installed are skipped."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cloth_ros import Cloth

from . import drop
from .sheets import dropped, scene

ENGINES = ('numpy_slices', 'taichi_explicit', 'mujoco_flex', 'newton_vbd', 'pybullet_soft')
# Sizes for engines other than `DEFAULT_SIZES`, which keep the duration below minutes.
DEFAULT_SIZES = (16, 32, 64)
SIZES = {'numpy_slices': (16, 32, 64, 128), 'taichi_explicit': (16, 32, 64, 128)}
_TICK = 1 / 60

# Engines with contact, and sizes at which a drop ends within a minute.
DROP_SIZES = {
    'taichi_explicit': (16, 32, 64),
    'mujoco_flex': (16, 32, 64),
    'newton_vbd': (16, 32, 64),
    'pybullet_soft': (16, 32),
}
# Ticks until a dropped sheet is measured, 1.5 s, and ticks that are timed.
_SETTLING, _TIMED = 90, 30
# The table or box as a collider of a scene.
_COLLIDERS: dict[str, dict[str, object]] = {
    'table': {'collider.table.type': 'plane'},
    'box': {
        'collider.box.type': 'box',
        'collider.box.size': [drop.BOX_EDGE] * 3,
        'collider.box.position': [0.0, 0.0, -drop.BOX_EDGE / 2],
    },
}


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


def _make(engine: Any, *arguments: object) -> tuple[str, Any]:
    """Return version and sheet of an engine; skip the test if it is not installed."""
    try:
        return engine.version(), engine.Sheet(*arguments)
    except ImportError as error:
        pytest.skip(f'{engine.NAME} is not installed: {error}')


@pytest.mark.parametrize('size', [16, 32, 64, 128])
@pytest.mark.parametrize('name', ENGINES)
def test_engine(benchmark, name, size):
    """Another engine, with the fastest setting found; see its module."""
    if size not in SIZES.get(name, DEFAULT_SIZES):
        pytest.skip('takes minutes')
    engine = importlib.import_module(f'.engines.{name}', __package__)
    version, sheet = _make(engine, size)
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


def time_drop(
    benchmark: Any,
    support: str,
    advance: Callable[[], object],
    positions: Callable[[], np.ndarray],
    **information: object,
) -> None:
    """
    Time ticks of a sheet that has fallen on a table or box; measure its depth in it.

    Parameters
    ----------
    benchmark
        Fixture of pytest-benchmark.
    support
        One of `drop.SUPPORTS`.
    advance
        Simulates a tick of the sheet, which has just been made.
    positions
        Returns the positions of its particles, m, shape (rows, columns, 3).
    **information
        What `report` tells the results apart by.

    """
    deepest = 0.0
    for _ in range(_SETTLING):
        advance()
        now = positions()
        if not drop.is_held(now):
            break
        deepest = max(deepest, drop.depth(now, support))
    benchmark.pedantic(advance, rounds=_TIMED, iterations=1)
    before = positions()
    advance()
    end = positions()
    held = drop.is_held(end)
    benchmark.extra_info.update(
        information,
        table='drop',
        support=support,
        held=held,
    )
    if held:
        benchmark.extra_info.update(
            depth=drop.depth(end, support),
            deepest=max(deepest, drop.depth(end, support)),
            stretch=drop.largest_stretch(end),
            speed=float(np.linalg.norm(end - before, axis=-1).max() / _TICK),
        )


@pytest.mark.parametrize('support', drop.SUPPORTS)
@pytest.mark.parametrize('size', [16, 32, 64])
def test_cloth_ros_dropped(benchmark, size, support):
    """Cloth of this package, dropped on a table or box."""
    collider = {
        'collider.names': [support],
        **_COLLIDERS[support],
        f'collider.{support}.friction': drop.FRICTION,
    }
    cloth = Cloth(dropped(size).with_parameters(collider))
    substeps = round(_TICK / cloth.substep)
    time_drop(
        benchmark,
        support,
        lambda: cloth.advance(_TICK),
        lambda: cloth.positions,
        engine='cloth_ros',
        size=size,
        settings=f'{substeps} substeps a tick and thickness of contact, both automatic',
    )


@pytest.mark.parametrize('support', drop.SUPPORTS)
@pytest.mark.parametrize('size', [16, 32, 64])
@pytest.mark.parametrize('name', DROP_SIZES)
def test_engine_dropped(benchmark, name, size, support):
    """Another engine, with the fastest setting found that does not sink in; see its module."""
    if size not in DROP_SIZES[name]:
        pytest.skip('takes minutes')
    engine = importlib.import_module(f'.engines.{name}', __package__)
    version, sheet = _make(engine, size, support)
    time_drop(
        benchmark,
        support,
        sheet.advance,
        sheet.positions,
        engine=f'{engine.NAME} {version}',
        size=size,
        settings=sheet.settings,
    )
