"""The example that simulates many cloths: on two processes, and when one of them is killed."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from distributed import LocalCluster
from ros import PATIENCE, Process

from cloth_ros import Scene
from examples.many_cloths import simulate, variations

SEEDS = 8
GUSTS = {'wind.gust.period': 0.4, 'wind.gust.duration': 0.3, 'sphere.radius': 0.0}
SCRIPT = (sys.executable, 'examples/many_cloths.py')


@pytest.fixture
def scene(tmp_path) -> Path:
    """A curtain in gusts that come at once."""
    path = tmp_path / 'scene.yaml'
    scene = Scene.from_yaml('config/gust.yaml').with_parameters(GUSTS)
    scene.to_yaml(path)
    return path


def check(path: Path, scene: Path, seconds: float) -> None:
    """Check that a file has the results of every seed, the same bits as in this process."""
    expected = Scene.from_yaml(scene)
    with h5py.File(path) as file:
        assert file['done'][:].all()
        assert file['parameters/wind.gust.seed'][:].tolist() == list(range(SEEDS))
        np.testing.assert_allclose(file['time'], [seconds / 2, seconds])
        assert file['positions'].attrs['unit'] == 'm'
        assert len(np.unique(file['energy'][:, -1])) == SEEDS
        for seed in range(SEEDS):
            each = expected.with_parameters({'wind.gust.seed': seed})
            for name, value in simulate(each, file['time'][:]).items():
                np.testing.assert_array_equal(file[name][seed], value)


def command(scene: Path, out: Path, seconds: float, *where: str) -> tuple[str, ...]:
    vary = ('--vary', 'wind.gust.seed', f'0:{SEEDS}')
    times = ('--seconds', str(seconds), '--every', str(seconds / 2))
    workers = where or ('--workers', '2')
    return (*SCRIPT, str(scene), *vary, *times, *workers, '--out', str(out))


def test_every_combination_is_a_run_and_what_cannot_be_run_is_refused(scene, tmp_path):
    parameters = [['drag', '0', '1'], ['wind.velocity', '[0, 1, 0]'], ['wind.gust.seed', '0:3']]
    names, scenes = variations(Scene.from_yaml(scene), parameters)
    assert names == ['drag', 'wind.velocity', 'wind.gust.seed']
    found = [(each.drag, each.wind.velocity, each.wind.gust.seed) for each in scenes]
    assert found == [(drag, (0, 1, 0), seed) for drag in (0, 1) for seed in (0, 1, 2)]
    for wrong, text in (
        ([], 'there is nothing to vary'),
        ([['drag']], 'there is nothing to vary'),
        ([['drag', '-1']], 'drag is -1'),
        ([['drga', '1']], "did you mean 'drag'?"),
        ([['sheet.rows', '5', '6']], 'sheet.rows cannot vary'),
        ([['solver.substeps', '1']], 'solver.substeps is 1'),
    ):
        with pytest.raises(ValueError, match=re.escape(text)):
            variations(Scene.from_yaml(scene), wrong)
    none = subprocess.run(
        [*SCRIPT, 'no.yaml', '--vary', 'drag', '1'], text=True, capture_output=True
    )
    assert none.returncode == 2
    assert none.stderr.startswith('many_cloths.py: ')
    assert none.stderr.count('\n') == 1


@pytest.mark.slow
def test_a_cluster_that_runs_already_is_used_by_its_address(scene, tmp_path):
    out = tmp_path / 'cloths.h5'
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        where = ('--scheduler', cluster.scheduler_address)
        subprocess.run(command(scene, out, 1.0, *where), check=True, timeout=280)
        assert len(cluster.scheduler_info['workers']) == 1
    check(out, scene, 1.0)


@pytest.mark.slow
def test_two_workers_give_the_same_bits_as_one_process(scene, tmp_path):
    out = tmp_path / 'cloths.h5'
    done = subprocess.run(command(scene, out, 1.0), text=True, capture_output=True, timeout=280)
    assert done.returncode == 0, done.stderr
    assert f'{SEEDS} cloths of 1 s in ' in done.stdout
    check(out, scene, 1.0)


def workers(process: Process) -> list[int]:
    """Return the processes of the workers."""
    children = Path(f'/proc/{process.process.pid}/task').glob('*/children')
    numbers = [int(each) for path in children for each in path.read_text().split()]
    return [each for each in numbers if 'spawn_main' in Path(f'/proc/{each}/cmdline').read_text()]


def wait_until(condition: Callable[[], object], process: Process) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, process.output
        time.sleep(0.02)


@pytest.mark.slow
def test_nothing_is_lost_when_a_worker_is_killed(scene, tmp_path):
    out, seconds = tmp_path / 'cloths.h5', 30.0
    process = Process(command(scene, out, seconds), dict(os.environ))
    try:
        wait_until(lambda: re.search(rf' [1-9]/{SEEDS} ', process.output), process)
        assert f' {SEEDS}/{SEEDS} ' not in process.output
        os.kill(workers(process)[0], signal.SIGKILL)
        wait_until(lambda: not process.alive, process)
        assert process.stop(0) == 0, process.output
    finally:
        process.end()
    check(out, scene, seconds)


@pytest.mark.slow
def test_an_interrupted_file_has_the_runs_that_are_done(scene, tmp_path):
    out = tmp_path / 'cloths.h5'
    process = Process(command(scene, out, 60.0), dict(os.environ))
    try:
        wait_until(lambda: re.search(rf' [1-9]/{SEEDS} ', process.output), process)
        assert process.stop(signal.SIGINT) == 130, process.output
    finally:
        process.end()
    with h5py.File(out) as file:
        done = file['done'][:]
        assert f'stopped: {done.sum()} of {SEEDS} runs are in {out}' in process.output
        assert 0 < done.sum() < SEEDS
        assert np.isfinite(file['positions'][:][done]).all()
        assert np.isnan(file['energy'][:][~done]).all()
    assert 'Traceback' not in process.output
