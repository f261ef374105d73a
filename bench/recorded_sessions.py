"""
A recorded session of each scene: repeated to the bit, simulated again, estimates compared.

    python -m bench.recorded_sessions FOLDER [--seconds 10] [--tolerance 1e-5] [--scenes …]

For each scene of config/, starts a node, moves its colliders, blows wind, changes parameters,
pauses and resets it, and records all of that from DDS by examples/record.py.  Then repeats the
bag, simulates it again with the tolerance, and compares the live error estimates with the errors
that a finer run finds in the same windows.  FOLDER gets the bags and the plots of the errors; the
table is written into the page.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from cloth_ros.recording.resimulation import Settings
from cloth_ros.recording.run import check_estimates, repeat, resimulate
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line
from tools.marked_block import fill

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from builders import SCENE_FILES
from ros import NODE, Process, environment, free_domain, probing
from sessions import compile_kernels, record_session

_NAME = 'python -m bench.recorded_sessions'
_HEADS = [
    'scene',
    'states repeated / that differ',
    'error at the end, largest / rms [mm]',
    'live estimates',
    'estimate / error found: median (least to greatest)',
]


def _progress(*_: int) -> None:
    """Show nothing."""


def record(scene: Path, bag: Path, seconds: float) -> None:
    """Record a session of a scene, s."""
    compile_kernels(scene)
    with free_domain() as domain:
        command = (*NODE, '--ros-args', '--params-file', str(scene))
        node = Process(command, environment(domain))
        try:
            node.wait_for_output('publishing')
            with probing(domain) as probe:
                record_session(probe, domain, scene, bag, round(60 * seconds))
        finally:
            node.end()


def measure(name: str, bag: Path, tolerance: float) -> list[str]:
    """Return a row of the table."""
    repeated = repeat(bag, None, _progress).result
    settings = Settings({'solver.tolerance': tolerance, 'solver.substeps': 0}, errors=True)
    again = resimulate(bag, None, settings, bag.with_name(f'{name}_again'), _progress).result
    found = check_estimates(bag, None, Settings(), _progress)
    print(*found.lines, sep='\n', flush=True)
    ratios = np.array([each['largest'] / each['found'] for each in found.result['estimates']])
    spread = ''
    if len(ratios):
        spread = f'{np.median(ratios):.2f} ({ratios.min():.2f} to {ratios.max():.2f})'
    return [
        name,
        f'{repeated["states"]} / {repeated["differing states"]}',
        f'{_millimetres(again, "largest")} / {_millimetres(again, "rms")}',
        f'{len(ratios)}',
        spread,
    ]


def _millimetres(result: dict[str, Any], kind: str) -> str:
    return f'{1e3 * result[f"{kind} error at the end [m]"]:.3g}'


def main() -> None:
    """Record and measure the scenes, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('folder', type=Path, help='folder for bags and plots')
    parser.add_argument('--seconds', type=float, default=10.0, help='of each session')
    parser.add_argument('--tolerance', type=float, default=1e-5, help='of the new run [m]')
    names = [path.stem for path in SCENE_FILES]
    parser.add_argument('--scenes', nargs='+', default=names, choices=names)
    parser.add_argument('--page', type=Path, help='page with a marked block for the table')
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for scene in SCENE_FILES:
        if scene.stem in options.scenes:
            bag = options.folder / scene.stem
            if not bag.exists():
                record(scene, bag, options.seconds)
            rows.append(measure(scene.stem, bag, options.tolerance))
            print(*rows[-1], sep=' | ', flush=True)
    machine = describe_in_a_line()
    text = f'{table(_HEADS, rows)}\n\nMeasured on: {machine}.'
    print(text)
    if options.page is not None:
        fill(options.page, _NAME, text)


if __name__ == '__main__':
    main()
