"""
Simulate one scene with many values of its parameters, on all cores or on a Dask cluster.

    python examples/many_cloths.py config/gust.yaml --vary wind.gust.seed 0:1000
    python examples/many_cloths.py config/hanging.yaml --vary springs.bending 5 50 --vary drag 0 1
    python examples/many_cloths.py SCENE --vary wind.gust.seed 0:1000 --scheduler tcp://host:8786

Needs no ROS: pip install 'cloth_ros[many]'.  The results are one HDF5 file.
"""

import argparse
import itertools
import logging
import os
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np

try:
    import h5py
    from distributed import Client, LocalCluster, as_completed
    from tqdm import tqdm
except ModuleNotFoundError as error:
    message = "many_cloths.py: there is no {}; install it: pip install 'cloth_ros[many]'"
    raise SystemExit(message.format(error.name)) from None

from cloth_ros import Cloth, Scene
from cloth_ros.model import check_scene
from cloth_ros.scene.parameter_file import read_value

Result = dict[str, np.ndarray]
# Names, shapes after (runs, samples), units and meanings of the results.
_RESULTS = {
    'positions': ('m', 'position of each particle: rows, columns, x y z'),
    'energy': ('J', 'kinetic, elastic and gravitational energy'),
    'largest_stretch': ('1', 'largest elongation relative to the rest length'),
}


def simulate(scene: Scene, times: np.ndarray) -> Result:
    """Return the results at each of the times, s; the same bits on every worker of a machine."""
    cloth = Cloth(scene)
    samples = []
    for end in times:
        ticks = max(round((end - cloth.time) * scene.rate), 1)
        for seconds in np.diff(np.linspace(cloth.time, end, ticks + 1)):
            cloth.advance(seconds)
        positions = cloth.positions.astype(np.float32)
        samples.append((positions, cloth.energy(), cloth.strain().stretch))
    columns = zip(*samples, strict=True)
    return {name: np.array(column) for name, column in zip(_RESULTS, columns, strict=True)}


def values_of(name: str, texts: list[str]) -> list[object]:
    """Return the values of `--vary`; 0:3 stands for 0, 1 and 2."""
    values: list[object] = []
    for text in texts:
        first, colon, last = text.partition(':')
        if colon and first.isdecimal() and last.isdecimal():
            values += range(int(first), int(last))
        else:
            values.append(read_value(name, text))
    return values


def variations(scene: Scene, varied: list[list[str]]) -> tuple[list[str], list[Scene]]:
    """Return the names that vary, and a scene for each combination; raises ValueError."""
    names = [name for name, *_ in varied]
    if fixed := {'sheet.rows', 'sheet.columns'} & set(names):
        raise ValueError(f'{fixed.pop()} cannot vary: all results have one shape; vary others')
    choices = [values_of(name, texts) for name, *texts in varied]
    if not names or not all(choices):
        raise ValueError('there is nothing to vary; give, for example, --vary drag 0.1 0.5')
    scenes = [
        scene.with_parameters(dict(zip(names, each, strict=True)))
        for each in itertools.product(*choices)
    ]
    for each in scenes:
        check_scene(each)
    return names, scenes


def create(path: Path, scenes: list[Scene], names: list[str], times: np.ndarray) -> h5py.File:
    """Create the file, with what is known before the runs; `done` says which have results."""
    file = h5py.File(path, 'w')
    sheet = scenes[0].sheet
    shape = (len(scenes), len(times))
    file['time'] = times
    file['time'].attrs['unit'] = 's'
    file['done'] = np.zeros(len(scenes), bool)
    flat = [scene.flat() for scene in scenes]
    for name in names:
        column = np.array([each[name] for each in flat])
        # Of lists of different lengths, too, the text.
        numeric = column.dtype.kind in 'biuf'
        file[f'parameters/{name}'] = column if numeric else [str(each[name]) for each in flat]
    file.attrs['parameters'] = '\n'.join(f'{name}: {value}' for name, value in flat[0].items())
    grid = {'positions': (sheet.rows, sheet.columns, 3)}
    for name, (unit, meaning) in _RESULTS.items():
        inner = grid.get(name, ())
        data = file.create_dataset(
            name, (*shape, *inner), 'f4' if inner else 'f8', fillvalue=np.nan,
            chunks=(1, 1 if inner else shape[1], *inner), compression='gzip', shuffle=True,
        )  # fmt: skip
        data.attrs.update(unit=unit, meaning=meaning)
    return file


def on_cluster(
    scenes: list[Scene], times: np.ndarray, scheduler: str | None, workers: int | None
) -> Iterator[tuple[int, Result]]:
    """Yield number and result of each run as it ends; those of a worker that dies are repeated."""
    with ExitStack() as stack:
        if scheduler is None:
            cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
            stack.enter_context(cluster)
        client = stack.enter_context(Client(scheduler or cluster))
        numbers = {
            client.submit(simulate, scene, times, key=f'cloth-{os.getpid()}-{number}'): number
            for number, scene in enumerate(scenes)
        }
        try:
            for future, result in as_completed(numbers, with_results=True):
                yield numbers.pop(future), result
                future.release()
        except KeyboardInterrupt:
            logging.disable()  # Dask logs each of its requests that the end cuts off
            raise


def in_this_process(scenes: list[Scene], times: np.ndarray) -> Iterator[tuple[int, Result]]:
    """Yield number and result of each run, one after the other, without Dask."""
    for number, scene in enumerate(scenes):
        yield number, simulate(scene, times)


def arguments() -> argparse.Namespace:
    """Return the checked command line."""
    parser = argparse.ArgumentParser(
        description='Simulate one scene with many values of its parameters, on all cores or on '
        'a Dask cluster.',
        epilog='example: many_cloths.py config/gust.yaml --vary wind.gust.seed 0:1000 --out g.h5',
    )
    parser.add_argument('scene', help='ROS parameter file')
    parser.add_argument(
        '--vary', nargs='+', action='append', default=[], metavar=('NAME', 'VALUE'),
        help='parameter and its values, 0:1000 for those from 0 to 999; of several parameters, '
        'each combination is a run',
    )  # fmt: skip
    parser.add_argument('--seconds', type=float, default=10.0, help='simulated time (default 10)')
    parser.add_argument(
        '--every', type=float, help='s, between two samples (default: only the final state)'
    )
    parser.add_argument('--out', type=Path, default=Path('cloths.h5'), help='HDF5 file to write')
    parser.add_argument(
        '--workers', type=int, help='processes (default: one a core; 0: this one, without Dask)'
    )
    parser.add_argument('--scheduler', help='address of a cluster, such as tcp://host:8786')
    options = parser.parse_args()
    options.every = options.seconds if options.every is None else options.every
    if not 0 < options.every <= options.seconds <= 1e6:
        parser.error('--every must be more than 0 s, and at most --seconds, which is at most 1e6')
    if options.workers is not None and options.workers < 0:
        parser.error(f'--workers is {options.workers}, but must be 0 or more')
    return options


def main() -> int:
    """Simulate every combination, and write each result as soon as it is there."""
    options = arguments()
    try:
        scene = Scene.from_yaml(options.scene)
        names, scenes = variations(scene, options.vary)
        times = options.every * np.arange(1, round(options.seconds / options.every) + 1)
        file = create(options.out, scenes, names, times)
    except (OSError, ValueError) as error:
        print(f'many_cloths.py: {error}', file=sys.stderr)
        return 2
    if options.scheduler is None:
        for _ in Cloth(scenes[0]).warm_up():  # compiled once, and not by every worker
            pass
    began = time.monotonic()
    if options.workers == 0 and options.scheduler is None:
        runs = in_this_process(scenes, times)
    else:
        runs = on_cluster(scenes, times, options.scheduler, options.workers)
    with file:
        try:
            for number, result in tqdm(runs, total=len(scenes), unit='cloth'):
                for name, value in result.items():
                    file[name][number] = value
                file['done'][number] = True
        except KeyboardInterrupt:
            logging.disable()  # as above
            runs.close()
            done = int(file['done'][:].sum())
            print(f'\nstopped: {done} of {len(scenes)} runs are in {options.out}', file=sys.stderr)
            return 130
        except OSError as error:  # no such cluster
            print(f'many_cloths.py: {error}', file=sys.stderr)
            return 2
    took = time.monotonic() - began
    simulated = len(scenes) * times[-1]
    print(
        f'{len(scenes)} cloths of {times[-1]:g} s in {took:.1f} s, {simulated / took:.1f} s of '
        f'simulated time per second: {options.out}'
    )
    return 0


if __name__ == '__main__':
    sys.exit(main())
