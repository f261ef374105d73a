"""Command `cloth_tradeoff`: measure speed against accuracy of a scene on this machine."""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ..command import Parser, run_command
from ..interrupt import StopSignal
from ..scene import Scene
from ..scene.parameter import checked_vector

_LONGEST = 60.0  # s
# Used by the study only, so not required by the package.
_LIBRARIES = ('matplotlib', 'scipy', 'tqdm')


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog='cloth_tradeoff',
        description='Measure the cost and the error of solver settings on this machine: a plot, '
        'tables, JSON and a recommendation for each scene.',
        epilog='example: cloth_tradeoff config/hanging.yaml --quick.  Interrupted, it continues '
        'where it stopped when it is started again.',
    )
    parser.add_argument('scenes', metavar='SCENE', nargs='+', help='scene file (YAML)')
    parser.add_argument(
        '--quick', action='store_true', help='fewer settings: about a minute per scene'
    )
    parser.add_argument(
        '--out',
        metavar='DIR',
        default='tradeoff',
        help='folder of the results (default: tradeoff)',
    )
    parser.add_argument(
        '--seconds',
        metavar='S',
        type=float,
        help='simulated time (default: 1, or less if that takes minutes)',
    )
    parser.add_argument(
        '--sphere',
        metavar=('X', 'Y', 'Z'),
        nargs=3,
        type=float,
        help='move the sphere to this position [m]',
    )
    parser.add_argument(
        '--over',
        metavar='S',
        type=float,
        default=0.3,
        help='duration of this movement (default: 0.3)',
    )
    parser.add_argument(
        '--fresh', action='store_true', help='ignore the results of earlier studies'
    )
    return parser


def _positive(name: str, value: float) -> float:
    if not 0 < value <= _LONGEST:
        remedy = f'write {_LONGEST if value > _LONGEST else 1.0:g}'
        raise ValueError(
            f'{name} is {value:g}, but must be above 0 and at most {_LONGEST:g} s; {remedy}'
        )
    return value


def _scenes(paths: Sequence[str]) -> dict[str, Scene]:
    """Return the scenes by name, which is that of the file without its extension."""
    from ..model import check_scene
    from ..model.time_step import stability_limit

    scenes: dict[str, Scene] = {}
    for path in paths:
        try:
            scene = Scene.from_yaml(path)
        except OSError as error:
            raise ValueError(f'{path}: {error.strerror or error}; give a scene file') from None
        try:
            check_scene(scene)
        except ValueError as error:
            raise ValueError(f'{path}: {error}') from None
        name = Path(path).stem
        if name in scenes:
            raise ValueError(f'two scenes have the name {name!r}; rename one of the files')
        if scene.pinned().all():
            raise ValueError(f'{path}: all particles are pinned; leave some out of pins')
        if math.isinf(stability_limit(scene)):
            raise ValueError(f'{path}: has no springs, nothing to study; set springs.structural')
        scenes[name] = scene
    return scenes


class _Bar:
    """Progress bar over the expected wall-clock time of a study."""

    def __init__(self, name: str) -> None:
        from tqdm import tqdm

        self._bar = tqdm(
            desc=name,
            total=0.0,
            bar_format='{desc:.48} {percentage:3.0f}%|{bar:20}| '
            '{elapsed} elapsed, {remaining} left',
            disable=None,  # only on a terminal
            leave=False,
        )
        self._name = name
        self._quiet = self._bar.disable

    def expect(self, seconds: float) -> None:
        """Set the total."""
        self._bar.total = max(seconds, 1e-3)
        self._bar.refresh()

    def __call__(self, text: str, seconds: float) -> None:
        """Show the next part, or, without a text, that a part of `seconds` s is done."""
        if text and self._quiet:
            print(f'  {text}', flush=True)
        elif text:
            self._bar.set_description_str(f'{self._name}: {text}')
        else:
            self._bar.total = max(self._bar.total, self._bar.n + seconds)
            self._bar.update(seconds)

    def close(self) -> None:
        """Remove the bar."""
        self._bar.close()


def _study(
    name: str, scene: Scene, arguments: argparse.Namespace, folder: Path, stop: StopSignal
) -> None:
    import shutil

    from . import plot, report
    from .cache import Cache
    from .explanation import recommendation_text
    from .schedule import Options, Schedule, start_time
    from .study import Study

    parts = folder / 'parts'
    if arguments.fresh:
        shutil.rmtree(parts, ignore_errors=True)
    goal = None
    if arguments.sphere is not None and scene.sphere.radius > 0:
        x, y, z = arguments.sphere
        goal = (x, y, z)
    elif arguments.sphere is not None:
        print(f'{name}: has no sphere; --sphere has no effect', file=sys.stderr)
    options = Options(arguments.quick, arguments.seconds, goal, arguments.over)
    bar = _Bar(name)

    def progress(text: str, seconds: float) -> None:
        stop.check()
        bar(text, seconds)

    start = time.perf_counter()
    try:
        waits = ', simulating up to the first gust' if start_time(scene) > 0 else ''
        progress(f'compiling{waits}', 0.0)
        cache = Cache(parts)
        study = Study(name, scene, Schedule(scene, options, cache), cache, progress)
        bar.expect(study.expected)
        result = study.run()
    finally:
        bar.close()
    (folder / 'result.json').write_text(json.dumps(result, indent=1) + '\n')
    (folder / 'report.md').write_text(report.page(result))
    plot.draw(result, folder)
    print(f'{name}: {folder / "report.md"} written after {time.perf_counter() - start:.0f} s')
    print(recommendation_text(result), flush=True)


def _run(arguments: argparse.Namespace, stop: StopSignal) -> int:
    """Check the arguments and the installation, then study each scene."""
    if arguments.seconds is not None:
        _positive('--seconds', arguments.seconds)
    _positive('--over', arguments.over)
    if arguments.sphere is not None:
        try:
            checked_vector('--sphere', arguments.sphere, 'sphere.position')
        except ValueError as error:
            text, _, closest = str(error).partition('; write ')
            numbers = closest.strip('[]').replace(',', '')
            raise ValueError(f'{text}; write --sphere {numbers}') from None
    for module in _LIBRARIES:
        if importlib.util.find_spec(module) is None:
            raise ModuleNotFoundError(name=module)
    for name, scene in _scenes(arguments.scenes).items():
        folder = Path(arguments.out) / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ValueError(
                f'--out {arguments.out}: {error.strerror}; give a folder to write to'
            ) from None
        _study(name, scene, arguments, folder, stop)
    return 0


def main(args: Sequence[str] | None = None) -> int:
    """Study the scenes of the command line until Ctrl-C; return the exit code."""
    run = partial(_run, _parser().parse_args(args))
    stopped = 'the same command continues from here'
    return run_command('cloth_tradeoff', 'tradeoff', run, stopped=stopped)


if __name__ == '__main__':
    sys.exit(main())
