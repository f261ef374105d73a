"""
The largest sheets that run live at 60 Hz: ``python -m bench.live_sheets [PAGE]``.

`hanging.yaml` and `drop_on_sphere.yaml` with other numbers of particles, for two seconds from
their start, on one thread and two, with the vector instructions of this processor and, where it
has AVX-512, without those.  Writes a table between its marks in PAGE (default:
docs/bench/live_sheets.md) and prints it.  Takes up to five minutes, and longer where kernels are
not compiled yet.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cloth_ros import Cloth, Scene
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe
from tools.marked_block import fill

PAGE = Path('docs/bench/live_sheets.md')
SCENES = {'hanging': 'hanging', 'draped over a sphere': 'drop_on_sphere'}
RATE = 60.0
# Share of real time that ticks may take in each second; the rest is for messages.
SHARE = 0.9
SIDES = range(16, 513, 8)
_SECONDS = 2.0
# Runs of a sheet that is not live, of which the least time of each tick counts: another process
# may have been in the way of one.  Two where the result is clear by this factor.
_RUNS, _CLEAR = 3, 1.5
# Share of the allowed time at which a run is given up.
_GIVEN_UP = 1.6
# The time of a tick is about proportional to this power of the side, for the first guesses.
_POWER = 3
_FIRST_GUESS = 128
AVX2 = {'NUMBA_CPU_NAME': 'znver2', 'NUMBA_CPU_FEATURES': '+avx2,+fma,-avx512f'}


class Found(NamedTuple):
    """
    The largest live sheet of a scene.

    Attributes
    ----------
    side
        Particles of a side; 0: none of `SIDES` is live.
    share
        Share of real time that its ticks took, in the worst second.

    """

    side: int
    share: float


def worst_share(times: list[float], rate: float = RATE) -> float:
    """Return the largest share of real time of consecutive ticks, s, over a second."""
    window = min(round(rate), len(times))
    sums = np.convolve(times, np.ones(window), 'valid')
    return float(sums.max() * rate / window)


def tick_times(scene: Scene, seconds: float = _SECONDS) -> list[float]:
    """Return the wall-clock time of each tick from the start, s, until it is clearly too much."""
    cloth = Cloth(scene)
    for _ in cloth.warm_up():
        pass
    times: list[float] = []
    for _ in range(round(seconds * scene.rate)):
        start = time.perf_counter()
        cloth.advance(1 / scene.rate)
        times.append(time.perf_counter() - start)
        if sum(times[-round(scene.rate) :]) > _GIVEN_UP * SHARE:
            break
    return times


def share_of_real_time(scene: Scene, limit: float = SHARE) -> float:
    """Return the share of real time that ticks take in the worst second."""
    times = tick_times(scene)
    for number in range(1, _RUNS):
        share = worst_share(times, scene.rate)
        if share <= limit or (number > 1 and share > _CLEAR * limit):
            break
        times = [min(pair) for pair in zip(times, tick_times(scene), strict=False)]
    return worst_share(times, scene.rate)


def largest_live(
    share_of: Callable[[int], float], sides: range = SIDES, first: int = _FIRST_GUESS
) -> Found:
    """
    Search the largest side whose share of real time is at most `SHARE`.

    Parameters
    ----------
    share_of
        Measures the share of a side.
    sides
        To choose from.
    first
        Side to begin with, or the nearest one.

    """
    low, high, best = -1, len(sides), Found(0, 0.0)
    guess = min(range(len(sides)), key=lambda index: abs(sides[index] - first))
    while high - low > 1:
        share = share_of(sides[guess])
        if share <= SHARE:
            low, best = guess, Found(sides[guess], share)
        else:
            high = guess
        wanted = sides[guess] * (SHARE / share) ** (1 / _POWER)
        guess = round((wanted - sides.start) / sides.step - 0.5)
        guess = min(max(guess, low + 1), high - 1)
    return best


def search(threads: int, sides: range) -> dict[str, Found]:
    """Return the largest live sheet of each scene in this process."""

    def share_of(name: str, side: int) -> float:
        scene = Scene.from_yaml(f'config/{name}.yaml').with_parameters(
            {
                'sheet.rows': side,
                'sheet.columns': side,
                'solver.threads': threads,
                'rate': RATE,
            }
        )
        share = share_of_real_time(scene)
        print(f'  {name}, {side} × {side}: {share:.2f} of real time', file=sys.stderr, flush=True)
        return share

    found: dict[str, Found] = {}
    first = _FIRST_GUESS
    for text, name in SCENES.items():
        found[text] = largest_live(partial(share_of, name), sides, first)
        first = found[text].side or first
    return found


def in_process(threads: int, changes: dict[str, str], sides: range) -> dict[str, Found]:
    """Return the same, measured in a process with changes of its environment."""
    command = [
        sys.executable, '-m', 'bench.live_sheets', '--threads', str(threads),
        '--sides', str(sides.start), str(sides.stop - 1), str(sides.step),
    ]  # fmt: skip
    result = subprocess.run(
        command, env={**os.environ, **changes}, stdout=subprocess.PIPE, text=True, check=True
    )
    return {name: Found(*found) for name, found in json.loads(result.stdout).items()}


def processors(vectors: str) -> dict[str, dict[str, str]]:
    """Return names of the kinds of processors, and the environment that each needs."""
    kinds: dict[str, dict[str, str]] = {vectors: {}}
    if vectors == 'avx512f':
        kinds['avx2 (emulated: the same processor, without its AVX-512 instructions)'] = AVX2
    return kinds


def report(sides: range) -> str:
    """Measure, and return a table in Markdown."""
    machine = describe()
    rows = []
    for kind, changes in processors(machine['vector instructions']).items():
        for threads in (1, 2):
            print(f'{kind}, {threads} thread(s)', file=sys.stderr, flush=True)
            found = in_process(threads, changes, sides)
            cells = [
                f'{each.side} × {each.side} ({each.share:.2f})' if each.side else 'none'
                for each in found.values()
            ]
            rows.append([kind, threads, *cells])
    head = ['vector instructions', 'cores', *SCENES]
    where = ', '.join(f'{name} {value}' for name, value in machine.items())
    return f'{table(head, rows)}\n\nMeasured on: {where}.'


def main() -> None:
    """Measure all, or in one process what `in_process` asks for."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().splitlines()[0])
    parser.add_argument('page', nargs='?', type=Path, default=PAGE)
    parser.add_argument(
        '--sides', type=int, nargs=3, metavar=('FIRST', 'LAST', 'STEP'),
        default=(SIDES.start, SIDES.stop - 1, SIDES.step), help='sides to choose from, particles',
    )  # fmt: skip
    parser.add_argument('--threads', type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    first, last, step = arguments.sides
    sides = range(first, last + 1, step)
    if arguments.threads:
        print(json.dumps(search(arguments.threads, sides)))
        return
    text = report(sides)
    fill(arguments.page, 'python -m bench.live_sheets', text)
    print(text)


if __name__ == '__main__':
    main()
