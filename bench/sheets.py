"""The sheet that all benchmarks share, and how its steps are timed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cloth_ros import Cloth, Scene

SIZES = (16, 32, 64, 128, 256, 512, 1024)
# Substeps that are timed together: a block, as the solver takes them.
BLOCK = 17
# Springs of all families and gravity, and nothing else.
BARE = {'wind.air_density': 0.0, 'drag': 0.0}


def scene(size: int, **changes: object) -> Scene:
    """Return a square sheet that hangs from two corners; two underscores stand for a dot."""
    dotted = {name.replace('__', '.'): value for name, value in changes.items()}
    return Scene().with_parameters(
        {
            'sheet.rows': size,
            'sheet.columns': size,
            'sheet.position': [0.0, 0.0, 1.5],
            **BARE,
            **dotted,
        }
    )


def time_substeps(benchmark: Any, cloth: Cloth, **information: object) -> None:
    """Time blocks of substeps of a cloth that has begun to move."""
    cloth.advance(1 / 60)
    seconds = BLOCK * cloth.substep
    particles = cloth.scene.sheet.rows * cloth.scene.sheet.columns
    timed(benchmark, lambda: cloth.advance(seconds), particles * BLOCK, **information)


def timed(benchmark: Any, run: Callable[[], object], steps: int, **information: object) -> None:
    """Time `run`, which takes so many particle steps."""
    benchmark.extra_info.update(information, steps=steps)
    run()
    # About a second, in no fewer rounds than tell a median.
    once = 5e-9 * steps
    rounds = max(7, min(200, int(1.0 / once)))
    benchmark.pedantic(run, rounds=rounds, iterations=1, warmup_rounds=2)
