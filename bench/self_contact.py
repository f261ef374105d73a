"""
Cost of the contact of a sheet with itself: ``python -m bench.self_contact``.

A towel of 0.6 m swings, hangs at rest, or lies flat on a table, with self-contact, which is not
needed there, and without; or lies on the table folded into four layers.  Prints Markdown:
milliseconds of processor time of one thread for a tick of 1/60 s, median, and the real-time factor
of all ticks together: new lists make some of them far longer.  With ``--threads 2`` it is elapsed
time, on a machine that has nothing else to do.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from cloth_ros import Cloth, Scene
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe

from .layers import folded, folded_again

TICK = 1 / 60
SIZE, THICKNESS = 0.6, 0.003
_TICKS = 120
# Seconds after which a towel swings that hangs from two corners, or lies flat, and hangs at rest.
_SWINGING, _AT_REST = 1.0, 10.0
# Seconds in which a folded towel comes to rest, and its drag meanwhile, 1/s.
_SETTLING, _SETTLING_DRAG = 1.5, 4.0


def towel(side: int, thickness: float, **changes: Any) -> Scene:
    """Return a scene with a towel and a table."""
    return Scene().with_parameters(
        {
            'sheet.rows': side,
            'sheet.columns': side,
            'sheet.size': (SIZE, SIZE),
            'sheet.mass': 0.1,
            'sheet.position': (0.0, 0.0, 0.001),
            'springs.structural': 200.0,
            'springs.shear': 50.0,
            'springs.bending': 2.0,
            'pins': [''],
            'drag': 2.0,
            'self_contact.thickness': thickness,
            'self_contact.friction': 0.5,
            'collider.names': ['table'],
            'collider.table.type': 'plane',
            'collider.table.friction': 0.5,
            **{name.replace('__', '.'): value for name, value in changes.items()},
        }
    )


def fold_twice(cloth: Cloth, seconds: float) -> None:
    """Assign a sheet that is folded into four layers; each fold comes to rest for some seconds."""
    sheet, thickness = cloth.scene.sheet, cloth.scene.self_contact.thickness
    cloth.positions = folded(sheet.rows, sheet.columns, sheet.size, 2 * thickness)
    cloth.advance(seconds)
    cloth.positions = folded_again(cloth.positions, thickness)
    cloth.velocities = np.zeros((sheet.rows, sheet.columns, 3))
    cloth.advance(seconds)


def four_layers(side: int, threads: int = 1) -> Cloth:
    """Return a towel that lies on the table folded into four layers."""
    cloth = Cloth(towel(side, THICKNESS, drag=_SETTLING_DRAG, solver__threads=threads))
    fold_twice(cloth, _SETTLING)
    return cloth


def tick_times(cloth: Cloth, ticks: int = _TICKS) -> tuple[float, float]:
    """
    Return the median and the mean time of a tick, s.

    Of one thread it is processor time, and elapsed time if there are several.
    """
    clock = time.thread_time if cloth.scene.solver.threads == 1 else time.perf_counter
    cloth.advance(TICK)
    times = []
    for _ in range(ticks):
        start = clock()
        cloth.advance(TICK)
        times.append(clock() - start)
    return float(np.median(times)), float(np.mean(times))


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--sides', type=int, nargs='+', default=[32, 64], help='particles')
    parser.add_argument('--threads', type=int, default=1)
    options = parser.parse_args()
    threads = {'solver__threads': options.threads}
    rows = []
    for side in options.sides:
        hanging: dict[str, Any] = {'pins': ['0,0', '0,-1'], 'sheet__position': (0.0, 0.0, 1.0)}
        for state, seconds, changes in (
            ('swinging', _SWINGING, hanging),
            ('hanging', _AT_REST, hanging),
            ('flat on a table', _SWINGING, {}),
        ):
            costs = []
            for thickness in (0.0, THICKNESS):
                cloth = Cloth(towel(side, thickness, **threads, **changes))
                cloth.advance(seconds)
                costs.append(tick_times(cloth)[0])
            ratio = f'{costs[1] / costs[0]:.2f}'
            rows.append([f'{side}²', state, *(f'{1e3 * cost:.2f}' for cost in costs), ratio, ''])
        cloth = four_layers(side, options.threads)
        cost, mean = tick_times(cloth)
        rows.append([f'{side}²', 'four layers', '', f'{1e3 * cost:.2f}', '', f'{TICK / mean:.2f}'])
    head = ['grid', 'state', 'without, ms', 'with, ms', 'ratio', 'real-time factor']
    print(', '.join(describe().values()) + f'\n\n{table(head, rows)}')


if __name__ == '__main__':
    main()
