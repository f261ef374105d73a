"""
A sheet that is folded once falls on itself, in this package and in other engines.

    python -m bench.folded [--sizes 16 32 64] [--page docs/bench/folded.md]

The sheet of all benchmarks, 1 m × 1 m and 0.2 kg, lies on a table with one half.  The other half
starts 0.1 m above, round a fold, and falls on the first.  Prints Markdown, or writes it into a
page: the real-time factor by the processor time of one thread, and how many triangles of the
sheet an edge of the sheet passes through, by the same independent check for every engine.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cloth_ros import Cloth, Scene
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line
from tools.marked_block import fill

from .drop import FRICTION
from .fold import THICKNESS, start

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from self_intersection import intersecting_edges, sheet_triangles

Array = NDArray[Any]

TICK = 1 / 60
ENGINES = ('newton_vbd', 'mujoco_flex')
_TICKS = 60
_FALL = 0.3  # s, until the halves touch
_MARK = 'python -m bench.folded'


class Sheet:
    """The sheet in this package."""

    def __init__(self, size: int) -> None:
        scene = Scene().with_parameters(
            {
                'sheet.rows': size,
                'sheet.columns': size,
                'pins': [''],
                # As limp as in the other engines, and as stiff as there in the plane of the sheet.
                'springs.structural': 700.0,
                'springs.bending': 0.0,
                'drag': 0.0,
                'wind.air_density': 0.0,
                'self_contact.thickness': THICKNESS,
                'self_contact.friction': FRICTION,
                'collider.names': ['table'],
                'collider.table.type': 'plane',
                'collider.table.friction': FRICTION,
            }
        )
        self._cloth = Cloth(scene)
        self._cloth.positions = start(size)
        begin = self._cloth.snapshot()
        self._cloth.advance(_FALL)  # which compiles what contact needs
        self._cloth.restore(begin)
        self.triangles = sheet_triangles(size, size)
        substeps = round(TICK / self._cloth.substep)
        self.settings = f'{substeps} substeps a tick and parts of contact, both automatic'

    def advance(self) -> None:
        """Simulate 1/60 s."""
        self._cloth.advance(TICK)

    def positions(self) -> Array:
        """Return the positions, m, shape (size, size, 3)."""
        return np.asarray(self._cloth.positions, float)


def measure(sheet: Any) -> dict[str, float]:
    """Simulate 1 s; return what the table lists."""
    seconds, most, pierced = [], 0, 0
    before = after = sheet.positions()
    for _ in range(_TICKS):
        begin = time.process_time()
        sheet.advance()
        seconds.append(time.process_time() - begin)
        before, after = after, sheet.positions()
        if not np.isfinite(after).all():
            return {'factor': np.nan}
        found = intersecting_edges(after, sheet.triangles)
        pierced = len(np.unique(np.sort(found[:, 2:], axis=1), axis=0))
        most = max(most, pierced)
    rest = 1 / (len(after) - 1)
    longest = max(np.linalg.norm(np.diff(after, axis=k), axis=-1).max() for k in (0, 1))
    return {
        'factor': TICK * _TICKS / sum(seconds),
        'slowest': TICK / max(seconds),
        'most': most,
        'end': pierced,
        'height': float(np.quantile(after[..., 2], 0.99)),
        'stretch': float(longest / rest - 1),
        'speed': float(np.linalg.norm(after - before, axis=-1).max() / TICK),
    }


def _row(size: int, name: str, sheet: Any) -> list[str]:
    result = measure(sheet)
    if np.isnan(result['factor']):
        return [f'{size} × {size}', name, 'not finite', '', '', '', '', '', '', sheet.settings]
    return [
        f'{size} × {size}',
        name,
        f'{result["factor"]:.3g}',
        f'{result["slowest"]:.2g}',
        f'{result["end"]}',
        f'{result["most"]}',
        f'{1e3 * result["height"]:.0f}',
        f'{result["stretch"]:.2f}',
        f'{result["speed"]:.2f}',
        sheet.settings,
    ]


def rows(size: int) -> list[list[str]]:
    """Return a row of the table for each engine that is installed."""
    result = [_row(size, 'cloth_ros', Sheet(size))]
    for name in ENGINES:
        engine = importlib.import_module(f'.engines.{name}', __package__)
        try:
            version, sheet = engine.version(), engine.Sheet(size, 'folded')
        except ImportError as error:
            print(f'{engine.NAME} is not installed: {error}', file=sys.stderr)
            continue
        result.append(_row(size, f'{engine.NAME} {version}', sheet))
    return result


def main() -> None:
    """Measure, and print a table or write it into a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--sizes', type=int, nargs='+', default=[16, 32, 64], help='particles')
    parser.add_argument('--page', type=Path, help='page with a marked block for the table')
    options = parser.parse_args()
    head = ['sheet', 'engine', 'real-time factor', 'in the slowest tick', 'intersecting']
    head += ['most after a tick', 'height [mm]', 'stretch', 'speed [m/s]', 'settings']
    machine = describe_in_a_line()
    lines = [row for size in options.sizes for row in rows(size)]
    text = f'{table(head, lines)}\n\nMeasured on: {machine}.'
    if options.page is None:
        print(text)
    else:
        fill(options.page, _MARK, text)


if __name__ == '__main__':
    main()
