"""
How still a cloth lies: ``python -m bench.rest [--page docs/bench/rest.md]``.

A free sheet of 0.8 m with 64 × 64 particles falls on a sphere, box or cylinder, with the default
drag, and drapes.  Prints Markdown: the root mean square speed of all its particles some time
later, with and without dashpots in its springs; and the wall-clock time of the last 5 s, as a
ratio to that without dashpots.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cloth_ros import Cloth, Scene
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line

SHAPES: dict[str, dict[str, Any]] = {
    'sphere': {'radius': 0.2},
    'box': {'size': (0.3, 0.3, 0.3)},
    'cylinder': {'radius': 0.2, 'length': 0.3},
}
# From the origin of each to its top, m.
_HEIGHTS = {'sphere': 0.2, 'box': 0.15, 'cylinder': 0.15}
SETTINGS = (
    ('double', 0.0), ('single', 0.0), ('single', 1e-4), ('single', 1e-3), ('single', 1e-2)
)  # fmt: skip
TIMES = (10.0, 15.0, 20.0)
_TOP = 0.48
_PAGE = """# How still a draped sheet lies

Written by `python -m bench.rest --page docs/bench/rest.md`. A free sheet of 0.8 m with 64 × 64
particles, without pins and with the default drag, falls on a collider and drapes: the root mean
square speed of all its particles some time later. Without losses in the cloth, its waves decay at
half the rate of the drag, and in single precision rounding keeps the sheet trembling. A sheet that
is still sliding or unfolding then is faster. The last column is the wall-clock time of the last
5 s, beside that without dashpots in the same precision.
"""


def draped(shape: str, damping: float, precision: str) -> Cloth:
    """Return a sheet just above a collider."""
    values = SHAPES[shape]
    height = _HEIGHTS[shape]
    body = {'type': shape, 'friction': 1.0, 'position': (0.0, 0.0, _TOP - height), **values}
    return Cloth(
        Scene().with_parameters(
            {
                'sheet.rows': 64,
                'sheet.columns': 64,
                'sheet.size': (0.8, 0.8),
                'sheet.position': (0.0, 0.0, 0.5),
                'pins': [''],
                'springs.damping': damping,
                'solver.precision': precision,
                'collider.names': ['body'],
                **{f'collider.body.{name}': value for name, value in body.items()},
            }
        )
    )


def speeds(cloth: Cloth) -> tuple[list[float], float]:
    """Return the speeds at `TIMES`, m/s, and the wall-clock time of the last part, s."""
    found, before, seconds = [], 0.0, 0.0
    for end in TIMES:
        start = time.perf_counter()
        cloth.advance(end - before)
        seconds, before = time.perf_counter() - start, end
        found.append(float(np.sqrt(np.mean(np.sum(cloth.velocities**2, axis=-1)))))
    return found, seconds


def rows() -> Iterator[list[str]]:
    """Yield the rows of the table."""
    for shape in SHAPES:
        undamped: dict[str, float] = {}
        for precision, damping in SETTINGS:
            found, seconds = speeds(draped(shape, damping, precision))
            ratio = seconds / undamped.setdefault(precision, seconds)
            cells = [f'{1e3 * each:.2g}' for each in found]
            yield [shape, precision, f'{damping:g}', *cells, f'{ratio:.2f}']


def main() -> None:
    """Print the table, or write it to a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--page', type=Path, help='file to write, with a title')
    page = parser.parse_args().page
    head = ['collider', 'precision', '`springs.damping`, N·s/m']
    head += [f'after {each:g} s, mm/s' for each in TIMES] + ['time']
    text = f'{table(head, rows())}\n\nMeasured on: {describe_in_a_line()}.'
    if page is None:
        print(text)
    else:
        page.write_text(f'{_PAGE}\n{text}\n')


if __name__ == '__main__':
    main()
