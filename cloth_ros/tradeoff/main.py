"""The command `cloth_tradeoff`: measures speed against accuracy on this machine."""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ..interrupt import StopSignal
from ..scene import Scene
from ..scene.parameter import checked_vector

_LONGEST = 60.0  # s


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints take one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and end."""
        self.exit(2, f'{self.prog}: {message}; see {self.prog} --help\n')


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog='cloth_tradeoff',
        description='Measure what each setting of the solver costs on this machine, and how '
        'wrong it is: a plot, tables, JSON and a recommendation for each scene.',
        epilog='An interrupted study goes on where it stopped when it is started again.',
    )
    parser.add_argument('scenes', metavar='SCENE', nargs='+', help='scene file (YAML)')
    parser.add_argument(
        '--quick', action='store_true', help='about a minute a scene instead of some'
    )
    parser.add_argument(
        '--out', metavar='DIR', default='tradeoff', help='where results go (default: tradeoff)'
    )
    parser.add_argument(
        '--seconds',
        metavar='S',
        type=float,
        help='simulated time (default: 1, or what is affordable)',
    )
    parser.add_argument(
        '--sphere',
        metavar=('X', 'Y', 'Z'),
        nargs=3,
        type=float,
        help='send the sphere there, in scenes that have one',
    )
    parser.add_argument(
        '--over', metavar='S', type=float, default=0.3, help='time that this takes (default: 0.3)'
    )
    parser.add_argument('--fresh', action='store_true', help='measure again what is there already')
    return parser


def _positive(name: str, value: float) -> float:
    if not 0 < value <= _LONGEST:
        raise ValueError(f'{name} is {value:g}, but must be above 0 and at most {_LONGEST:g} s')
    return value


def _scenes(paths: Sequence[str]) -> dict[str, Scene]:
    """Read the scenes, by the names that their results are given."""
    scenes: dict[str, Scene] = {}
    for path in paths:
        try:
            scene = Scene.from_yaml(path)
        except OSError as error:
            raise ValueError(f'{path}: {error.strerror or error}') from None
        name = Path(path).stem
        if name in scenes:
            raise ValueError(f'two scenes are called {name!r}; rename one of the files')
        if scene.pinned().all():
            raise ValueError(f'{path}: every particle is pinned, nothing moves; free some')
        if math.isinf(scene.stability_limit()):
            raise ValueError(f'{path}: without springs there is no cloth to study; add some')
        scenes[name] = scene
    return scenes


class _Bar:
    """A progress bar over the seconds that the whole is expected to take."""

    def __init__(self, name: str) -> None:
        from tqdm import tqdm

        self._bar = tqdm(
            desc=name,
            total=0.0,
            bar_format='{desc:.48} {percentage:3.0f}%|{bar:20}| {elapsed} gone, {remaining} left',
            disable=None,  # no bar where nobody watches
            leave=False,
        )
        self._name = name
        self._quiet = self._bar.disable

    def expect(self, seconds: float) -> None:
        """Set the total."""
        self._bar.total = max(seconds, 1e-3)
        self._bar.refresh()

    def __call__(self, text: str, seconds: float) -> None:
        """Say what comes next, or that what was expected to take `seconds` is done."""
        if text and self._quiet:
            print(f'  {text}', flush=True)
        elif text:
            self._bar.set_description_str(f'{self._name}: {text}')
        else:
            self._bar.total = max(self._bar.total, self._bar.n + seconds)
            self._bar.update(seconds)

    def close(self) -> None:
        """Leave the line to what follows."""
        self._bar.close()


def _study(
    name: str, scene: Scene, arguments: argparse.Namespace, folder: Path, stop: StopSignal
) -> None:
    import shutil

    from . import plot, report
    from .cache import Cache
    from .schedule import Options, Schedule
    from .study import Study

    parts = folder / 'parts'
    if arguments.fresh:
        shutil.rmtree(parts, ignore_errors=True)
    goal = None
    if arguments.sphere is not None and scene.sphere.radius > 0:
        x, y, z = arguments.sphere
        goal = (x, y, z)
    elif arguments.sphere is not None:
        print(f'{name}: has no sphere to send anywhere; --sphere is left out', file=sys.stderr)
    options = Options(arguments.quick, arguments.seconds, goal, arguments.over)
    bar = _Bar(name)

    def progress(text: str, seconds: float) -> None:
        stop.check()
        bar(text, seconds)

    start = time.perf_counter()
    try:
        progress('compiling, and up to the first gust', 0.0)
        store = Cache(parts)
        study = Study(name, scene, Schedule(scene, options, store), store, progress)
        bar.expect(study.expected)
        result = study.run()
    finally:
        bar.close()
    (folder / 'result.json').write_text(json.dumps(result, indent=1) + '\n')
    (folder / 'report.md').write_text(report.page(result))
    plot.draw(result, folder)
    print(f'{name}: {folder / "report.md"}, after {time.perf_counter() - start:.0f} s')
    print(report.recommendation_text(result), flush=True)


def _run(arguments: argparse.Namespace, stop: StopSignal) -> None:
    """Study every scene that is named."""
    if arguments.seconds is not None:
        _positive('--seconds', arguments.seconds)
    _positive('--over', arguments.over)
    if arguments.sphere is not None:
        checked_vector('--sphere', arguments.sphere, 'sphere.position')
    for name, scene in _scenes(arguments.scenes).items():
        folder = Path(arguments.out) / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ValueError(f'--out {arguments.out}: {error.strerror}') from None
        _study(name, scene, arguments, folder, stop)


def _explain(error: BaseException) -> int:
    """Say in a line why there is no study, and return the exit code; raise what is no reason."""
    if isinstance(error, ModuleNotFoundError):
        reason = f'there is no {error.name}; install it: pip install {error.name}'
    elif isinstance(error, (ValueError, OSError)):
        reason = str(error)
    else:
        raise error
    print(f'cloth_tradeoff: {reason}', file=sys.stderr)
    return 2


def main(args: Sequence[str] | None = None) -> int:
    """Study every scene that is named, until Ctrl-C; return the exit code."""
    arguments = _parser().parse_args(args)
    stop = StopSignal(signal.SIGINT)
    try:
        _run(arguments, stop)
    except BaseException as error:
        if not stop.requested:
            return _explain(error)
        print('\ncloth_tradeoff: stopped; the same command goes on from here', file=sys.stderr)
        return 130
    finally:
        stop.restore()
    return 0


if __name__ == '__main__':
    sys.exit(main())
