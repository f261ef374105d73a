"""Command `cloth_resimulate`: repeat a recorded session, or simulate it again."""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..command import Parser, run_command
from ..interrupt import StopSignal
from ..scene.parameter_file import read_value
from .progress_bar import ProgressBar

_PRECISIONS = ('single', 'double', 'auto')


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog='cloth_resimulate',
        description='Repeat a recorded session of a live cloth and compare it with the recorded '
        'states, bit by bit; or, with other settings, simulate it again from the same inputs, and '
        'write a new bag and the error of the recorded run.',
        epilog='examples: cloth_resimulate my_bag;  cloth_resimulate my_bag --tolerance 1e-5 '
        '--precision double.  The exit code is 0; 1 if a recorded state differs, or none can be '
        'compared; 2 for an error.',
    )
    parser.add_argument('bag', type=Path, metavar='BAG', help='bag, or folder of bags')
    parser.add_argument('--cloth', metavar='NODE', help='full name of the node, such as /cloth')
    new = parser.add_argument_group('simulate again with')
    new.add_argument('--substeps', type=int, metavar='N', help='substeps a tick')
    new.add_argument('--precision', choices=_PRECISIONS, help='of the numbers')
    new.add_argument('--tolerance', type=float, metavar='M', help='position error aimed for [m]')
    new.add_argument(
        '--grid',
        metavar='FACTOR or ROWSxCOLUMNS',
        help='so many times as fine a grid: 2, 0.5, …; or its particles',
    )
    new.add_argument(
        '--set', action='append', default=[], metavar='NAME=VALUE', help='any other parameter'
    )
    new.add_argument(
        '--check-estimates',
        action='store_true',
        help='write no bag, but compare the error estimates in the recorded /diagnostics with '
        'the error that the new run finds in the same windows of time',
    )
    new.add_argument(
        '--errors',
        action='store_true',
        help='write the error of each particle to the new bag, as the topic NODE/error',
    )
    parser.add_argument(
        '--out', type=Path, metavar='DIR', help='folder of the results (default: BAG_resimulated)'
    )
    parser.add_argument('--scheduler', metavar='ADDRESS', help='Dask cluster for a folder of bags')
    return parser


def _changes(options: argparse.Namespace) -> dict[str, Any]:
    """Return the parameters to change; raises ValueError."""
    changes: dict[str, Any] = {}
    for text in options.set:
        name, equals, value = text.partition('=')
        if not equals or not name:
            raise ValueError(f'--set {text} has no value; write --set {name or "drag"}=VALUE')
        changes[name] = read_value(name, value)
    if options.tolerance is not None:
        changes |= {'solver.tolerance': options.tolerance, 'solver.substeps': 0}
    if options.substeps is not None:
        changes['solver.substeps'] = options.substeps
    if options.precision is not None:
        changes['solver.precision'] = options.precision
    return changes


def _refinement(text: str | None) -> float | tuple[int, int]:
    """Return a factor of the grid, or its rows and columns; raises ValueError."""
    if text is None:
        return 1.0
    if sides := re.fullmatch(r'(\d{1,9})[x×](\d{1,9})', text):
        return int(sides[1]), int(sides[2])
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 0 < factor <= 100:
        raise ValueError(
            f'--grid is {text}, but must be a factor above 0 and at most 100, or rows and columns '
            'such as 63x63; write 2'
        )
    return factor


def _bags(path: Path) -> list[Path]:
    """Return the bags in a folder of bags; empty if the path is a bag itself."""
    from .bag import is_bag

    if not path.is_dir() or is_bag(path):
        return []
    return sorted(each for each in path.iterdir() if each.is_dir() and is_bag(each))


def _run(options: argparse.Namespace, stop: StopSignal) -> int:
    with stop.deferred():
        from .many import on_dask
        from .resimulation import Settings
        from .run import Outcome, check_estimates, repeat, resimulate

    changes = _changes(options)
    refinement = _refinement(options.grid)
    settings = None
    if changes or options.grid is not None or options.errors:
        settings = Settings(changes, refinement, options.errors)
    bags = _bags(options.bag)
    path = options.bag
    folder = options.out or path.with_name(f'{path.resolve().name}_resimulated')
    outcomes: list[Outcome] = []
    if bags and options.check_estimates:
        raise ValueError(
            f'--check-estimates takes one bag, and {path} has {len(bags)}; give {bags[0]}'
        )
    if bags:
        ended = on_dask(bags, options.cloth, settings, folder, options.scheduler, stop)
        for bag, outcome in ended:
            outcomes.append(outcome)
            print(*(f'{bag.name}: {line}' for line in outcome.lines), sep='\n', flush=True)
            stop.check()
    else:
        bar = ProgressBar(stop, 'tick')
        try:
            if options.check_estimates:
                outcomes = [check_estimates(path, options.cloth, settings or Settings(), bar)]
            elif settings is None:
                outcomes = [repeat(path, options.cloth, bar)]
            else:
                outcomes = [resimulate(path, options.cloth, settings, folder, bar)]
        finally:
            bar.close()
        print(*outcomes[0].lines, sep='\n')
        if settings is not None and not options.check_estimates:
            print(f'{folder} written')
    if bags or (options.out is not None and (settings is None or options.check_estimates)):
        folder.mkdir(parents=True, exist_ok=True)
        results = [outcome.result for outcome in outcomes]
        (folder / 'results.json').write_text(json.dumps(results, indent=1) + '\n')
    if any('error' in outcome.result for outcome in outcomes):
        return 2
    return 0 if all(outcome.identical for outcome in outcomes) else 1


def main(args: Sequence[str] | None = None) -> int:
    """Do what the command line says until Ctrl-C; return the exit code."""
    options = _parser().parse_args(args)
    run = partial(_run, options)
    stopped = 'what was written is complete'
    return run_command('cloth_resimulate', 'recording', run, stopped=stopped)


if __name__ == '__main__':
    sys.exit(main())
