"""Command `cloth_export`: the particles of a bag as a mesh over time."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ...command import Parser, run_command
from ...interrupt import StopSignal
from ..progress_bar import ProgressBar
from .mesh_writer import FORMATS


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog='cloth_export',
        description='Write the recorded particles of a cloth as a mesh over time, for programs '
        'that show, edit or render it. The extension of OUT is the kind of file: .usdc, .usd or '
        '.usda (Universal Scene Description, for Blender and others), .pvd (a list of VTU files, '
        'which are in the folder NAME_vtu, for ParaView).',
        epilog='examples: cloth_export my_bag cloth.usdc --fps 24;  cloth_export my_bag cloth.pvd '
        '--start 2 --end 5.  The exit code is 0, or 2 for an error.',
    )
    parser.add_argument('bag', type=Path, metavar='BAG', help='bag with particles')
    parser.add_argument(
        'out', type=Path, metavar='OUT', help=f'file to make: NAME{", NAME".join(FORMATS)}'
    )
    parser.add_argument('--cloth', metavar='NODE', help='full name of the node, such as /cloth')
    parser.add_argument(
        '--fps',
        type=float,
        metavar='N',
        help='so many frames per second, each the nearest recorded state (default: every state at '
        'its own time)',
    )
    parser.add_argument(
        '--start',
        type=float,
        default=0.0,
        metavar='S',
        help='first time, after the first state [s]',
    )
    parser.add_argument(
        '--end', type=float, default=math.inf, metavar='S', help='last time (default: the end) [s]'
    )
    return parser


def _check(options: argparse.Namespace) -> None:
    """Raise ValueError for what cannot be done, before anything is read."""
    out, fps, start, end = options.out, options.fps, options.start, options.end
    if fps is not None and not 0.001 <= fps <= 1000:
        raise ValueError(f'--fps is {fps:g}, but must be 0.001 to 1000 Hz; write 24')
    if not 0 <= start < math.inf:
        raise ValueError(f'--start is {start:g}, but must be a time from 0 s on; write 0')
    if not end >= start:
        raise ValueError(f'--end is {end:g}, but must not be before --start; write {start + 1:g}')
    if out.exists():
        raise ValueError(f'{out} exists already; give another name')
    if not out.parent.is_dir():
        raise ValueError(f'{out.parent} is no folder; make it, or give another name')


def _run(options: argparse.Namespace, stop: StopSignal) -> int:
    with stop.deferred():
        from .export import export
        from .mesh_writer import writer_for

        make_writer = writer_for(options.out)
    _check(options)
    stop.defer()  # between two frames only, so that the file is complete
    bar = ProgressBar(stop, 'state')
    fps = options.fps or 0.0
    try:
        lines = export(
            options.bag,
            options.cloth,
            partial(make_writer, options.out),
            options.start,
            options.end,
            fps,
            bar,
        )
    finally:
        bar.close()
    print(*lines, f'{options.out} written', sep='\n')
    return 0


def main(args: Sequence[str] | None = None) -> int:
    """Do what the command line says until Ctrl-C; return the exit code."""
    options = _parser().parse_args(args)
    run = partial(_run, options)
    stopped = 'what was written is complete'
    return run_command('cloth_export', 'export', run, stopped=stopped)


if __name__ == '__main__':
    sys.exit(main())
