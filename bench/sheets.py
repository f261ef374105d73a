"""The sheet of all benchmarks, and the timing of its substeps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cloth_ros import Cloth, Scene
from cloth_ros.model.time_step import CHECK_INTERVAL

from .drop import HEIGHT

SIZES = (16, 32, 64, 128, 256, 512, 1024)
# Substeps that are timed together: those between two checks of the solver.
SUBSTEPS = CHECK_INTERVAL
# Springs of all families and gravity alone.
SPRINGS_AND_GRAVITY = {'wind.air_density': 0.0, 'drag': 0.0}


def scene(size: int, **changes: object) -> Scene:
    """Return a square sheet that hangs from two corners; two underscores in a name mean a dot."""
    dotted = {name.replace('__', '.'): value for name, value in changes.items()}
    return Scene().with_parameters(
        {
            'sheet.rows': size,
            'sheet.columns': size,
            'sheet.position': [0.0, 0.0, 1.5],
            **SPRINGS_AND_GRAVITY,
            **dotted,
        }
    )


def dropped(size: int, **changes: object) -> Scene:
    """Return the same sheet, free and at rest above the table or box of `drop`."""
    return scene(size, **{'pins': [''], 'sheet__position': [0.0, 0.0, HEIGHT], **changes})


def time_substeps(benchmark: Any, cloth: Cloth, **information: object) -> None:
    """Time batches of substeps of a cloth that is already in motion."""
    cloth.advance(1 / 60)
    seconds = SUBSTEPS * cloth.substep
    particles = cloth.scene.sheet.rows * cloth.scene.sheet.columns
    timed(benchmark, lambda: cloth.advance(seconds), particles * SUBSTEPS, **information)


def timed(benchmark: Any, run: Callable[[], object], steps: int, **information: object) -> None:
    """
    Time `run`.

    Parameters
    ----------
    benchmark
        Fixture of pytest-benchmark.
    run
        What to time.
    steps
        Work in one call of it: substeps times particles, operations or bytes.
    **information
        What `report` tells the results apart by.

    """
    benchmark.extra_info.update(information, steps=steps)
    run()
    # About a second in total, but enough rounds for a median.
    once = 5e-9 * steps
    rounds = max(7, min(200, int(1.0 / once)))
    benchmark.pedantic(run, rounds=rounds, iterations=1, warmup_rounds=2)
