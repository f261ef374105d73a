"""
What substeps that follow the present state gain: ``python -m bench.step_lengths [PAGE]``.

`hanging.yaml` and `gust.yaml` with 32 × 32 to 256 × 256 particles, also with all springs a hundred
times as stiff, on one thread and two: substeps in a tick and time of a tick, with substeps that
follow the present state and with as many as are stable in every state.  The two cloths of a pair
start from the same state, after a second, and their ticks alternate.  Writes a table between its
marks in PAGE (default: docs/bench/step_lengths.md) and prints it.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import numpy as np

from cloth_ros import Cloth, Scene
from cloth_ros.model.time_step import substep_length
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line
from tools.marked_block import fill

PAGE = Path('docs/bench/step_lengths.md')
SCENES = ('hanging', 'gust')
SIDES = (32, 64, 128, 256)
STIFFNESS = (1, 100)
THREADS = [1, 2] if (os.cpu_count() or 1) > 1 else [1]
_SETTLING = 1.0
# Ticks of each cloth, of about so many s in total.
_LEAST, _MOST, _TOTAL = 5, 60, 2.0
_QUINTILE = 20  # %, of the times of ticks


def scene(name: str, side: int, stiffness: float, threads: int) -> Scene:
    """Return a scene of config/ with other particles, springs and threads, single precision."""
    known = Scene.from_yaml(f'config/{name}.yaml')
    springs = {
        f'springs.{each}': stiffness * getattr(known.springs, each)
        for each in ('structural', 'shear', 'bending')
    }
    return known.with_parameters(
        {
            'sheet.rows': side,
            'sheet.columns': side,
            'solver.precision': 'single',
            'solver.threads': threads,
            **springs,
        }
    )


def compare(following: Scene) -> tuple[int, int, float, float]:
    """Return substeps in a tick and time of a tick, s, of both: following, and for all states."""
    tick = 1 / following.rate
    count = round(tick / substep_length(following))
    cloths = [Cloth(following), Cloth(following.with_parameters({'solver.substeps': count}))]
    coarse = following.with_parameters({'sheet.rows': 32, 'sheet.columns': 32})
    start = Cloth(coarse)
    start.advance(_SETTLING)
    times: list[list[float]] = [[], []]
    for each in cloths:
        each.restore(start.snapshot())
        each.advance(tick)
    begin = time.perf_counter()
    while len(times[0]) < _LEAST or (
        len(times[0]) < _MOST and time.perf_counter() - begin < _TOTAL
    ):
        for each, taken in zip(cloths, times, strict=True):
            before = time.perf_counter()
            each.advance(tick)
            taken.append(time.perf_counter() - before)
    fast, slow = (float(np.percentile(each, _QUINTILE)) for each in times)
    return cloths[0].substeps, count, fast, slow


def rows() -> list[list[str]]:
    """Return the rows of the table."""
    found = []
    for name in SCENES:
        for stiffness in STIFFNESS:
            for side in SIDES:
                for threads in THREADS:
                    now, before, fast, slow = compare(scene(name, side, stiffness, threads))
                    found.append(
                        [
                            f'{name}, {side} × {side}'
                            + f', stiffness × {stiffness}' * (stiffness > 1),
                            str(threads),
                            str(before),
                            str(now),
                            f'{1e3 * slow:.3g}',
                            f'{1e3 * fast:.3g}',
                            f'{slow / fast:.2f}',
                        ]
                    )
                    print('  '.join(found[-1]), flush=True)
    return found


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().splitlines()[0])
    parser.add_argument('page', nargs='?', type=Path, default=PAGE)
    page = parser.parse_args().page
    head = (
        'sheet', 'threads', 'substeps, every state', 'present state', 'tick, every state [ms]',
        'present state [ms]', 'gain',
    )  # fmt: skip
    found = table(head, rows())
    where = describe_in_a_line()
    fill(page, 'python -m bench.step_lengths', f'{found}\n\nMeasured on: {where}.')
    print(found)


if __name__ == '__main__':
    main()
