"""A session simulated again: the error of the recorded run, and a new bag of the same form."""

import csv
import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from builders import ROOT, scene_of
from recordings import diagnostics, record

from cloth_ros import Cloth
from cloth_ros.live.tick_record import decode_record
from cloth_ros.recording import run
from cloth_ros.recording.bag import Bag, deserialise
from cloth_ros.recording.main import main
from cloth_ros.recording.output_bag import OutputBag
from cloth_ros.recording.resimulation import Settings

SCENE = scene_of(sheet__rows=8, sheet__columns=9, wind__velocity=(0.0, 3.0, 0.0))
FINE = {'solver.substeps': 60, 'solver.precision': 'double'}
PERIOD = 1 / 60


def blow(live, tick):
    live.set_wind((0.0, 3.0 + 0.05 * tick, 0.0))


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return record(tmp_path_factory.mktemp('session') / 'bag', SCENE, 40, blow, keyframes=15)


def rows(folder):
    with (folder / 'error.csv').open() as file:
        return [[float(value) for value in row] for row in list(csv.reader(file))[1:]]


def states(path, topic='/cloth/particles'):
    return [deserialise(each) for each in Bag(path).messages() if each.topic == topic]


def test_the_error_is_the_distance_from_the_finer_run(bag, tmp_path, capsys):
    out = tmp_path / 'out'
    arguments = ['--substeps', '60', '--precision', 'double', '--errors', '--out', str(out)]
    assert main([str(bag), *arguments]) == 0
    assert 'largest error [mm]' in capsys.readouterr().out
    # By hand: from the keyframe of the first tick on.
    coarse, fine = Cloth(SCENE), Cloth(SCENE.with_parameters(FINE))
    coarse.wind = (0.0, 3.05, 0.0)
    coarse.advance(PERIOD)
    fine.restore(coarse.snapshot())
    errors = []
    for tick in range(2, 41):
        for cloth in (coarse, fine):
            cloth.wind = (0.0, 3.0 + 0.05 * tick, 0.0)
            cloth.advance(PERIOD)
        errors.append(np.linalg.norm(fine.positions - coarse.positions, axis=-1))
    found = rows(out)
    np.testing.assert_allclose([row[2] for row in found], [e.max() for e in errors], atol=2e-7)
    rms = [np.sqrt(np.mean(e**2)) for e in errors]
    np.testing.assert_allclose([row[3] for row in found], rms, atol=2e-7)
    assert max(row[2] for row in found) > 1e-5
    # For each particle, on a topic.
    clouds = states(out / 'bag', '/cloth/error')
    assert [field.name for field in clouds[0].fields] == ['x', 'y', 'z', 'error']
    values = np.frombuffer(clouds[-1].data, np.float32).reshape(8, 9, 4)
    np.testing.assert_allclose(values[..., 3], errors[-1], atol=2e-7)
    # The new bag has the new run, which is repeated to the bit.
    newest = np.frombuffer(states(out / 'bag')[-1].data, np.float32).reshape(8, 9, 6)
    np.testing.assert_array_equal(newest[..., :3], fine.positions.astype(np.float32))
    again = run.repeat(out / 'bag', None, lambda *_: None)
    assert again.identical, again.lines
    assert again.result['states'] == 39
    summary = json.loads((out / 'error.json').read_text())
    assert summary['largest error [m]'] == pytest.approx(max(row[2] for row in found), rel=1e-5)
    assert (out / 'error.png').stat().st_size > 10_000


def test_with_the_same_scene_there_is_no_error_on_any_grid(bag, tmp_path):
    assert main([str(bag), '--set', 'drag=0.5', '--out', str(tmp_path / 'same')]) == 0
    assert max(row[2] for row in rows(tmp_path / 'same')) < 1e-6  # rounded to single precision
    assert main([str(bag), '--grid', '2', '--out', str(tmp_path / 'fine')]) == 0
    errors = [row[2] for row in rows(tmp_path / 'fine')]
    assert 1e-4 < max(errors) < 0.1
    assert {(cloud.height, cloud.width) for cloud in states(tmp_path / 'fine/bag')} == {(15, 17)}
    assert main([str(bag), '--grid', '15x17', '--out', str(tmp_path / 'sides')]) == 0
    assert rows(tmp_path / 'sides') == rows(tmp_path / 'fine')


def test_estimates_are_compared_with_the_error_in_their_windows(tmp_path):
    """
    Of the ticks 11 to 20, published after the tick 30: after a reset, their times come again.

    One of ticks before the first keyframe, one across the reset, and one of ticks that have
    another length have no window, and do not hide it.
    """

    def act(live, tick):
        if tick == 31:
            live.reset()
        blow(live, tick)

    bag = record(tmp_path / 'session', SCENE, 60, act)
    published = {  # after a tick: simulated time then, last tick and ticks of the window, error
        30: [(30, 5, 10, 1.0), (30, 20, 10, 1e-5)],
        45: [(15, 5, 10, 2.0), (15, 12, 7.5, 3.0)],
        60: [(30, 25, 5, 2e-5)],
    }
    part = OutputBag(tmp_path / 'bag', '/cloth', 'world')
    for message in Bag(bag).messages():
        part.copy(message)
        if message.topic == '/cloth/ticks':
            tick = decode_record(deserialise(message).data).tick
            for now, last, window, error in published.get(tick, ()):
                times = now * PERIOD, (now - last) * PERIOD, window * PERIOD
                part.copy(diagnostics(message.received, *times, error))
    part.close()
    found = run.check_estimates(tmp_path / 'bag', None, Settings(FINE), lambda *_: None)
    coarse, fine = Cloth(SCENE), Cloth(SCENE.with_parameters(FINE))
    errors, windows = [], {(10, 20), (50, 55)}
    for tick in range(1, 61):
        if tick == 31:
            coarse.reset()
        for cloth in (coarse, fine):
            cloth.wind = (0.0, 3.0 + 0.05 * tick, 0.0)
            cloth.advance(PERIOD)
        if tick in {last for _, last in windows}:
            errors.append(np.linalg.norm(fine.positions - coarse.positions, axis=-1).max())
        if tick in {first for first, _ in windows}:
            fine.restore(coarse.snapshot())
    estimates = found.result['estimates']
    assert [each['largest'] for each in estimates] == [1e-5, 2e-5]
    assert [each['found'] for each in estimates] == pytest.approx(errors, rel=1e-9)


def test_a_loaded_state_is_in_the_new_bag(tmp_path):
    def act(live, tick):
        live.set_wind((0.0, 0.3 * tick, 0.0))
        if tick == 10:
            act.saved = live.snapshot()
        if tick == 20:
            assert live.restore(act.saved)

    path = record(tmp_path / 'bag', SCENE, 30, act)
    assert main([str(path), '--substeps', '40', '--out', str(tmp_path / 'new')]) == 0
    again = run.repeat(tmp_path / 'new/bag', None, lambda *_: None)
    assert again.identical, again.lines
    assert again.result['states'] == 29


def test_the_error_over_time_goes_on_behind_a_reset(tmp_path, capsys):
    def act(live, tick):
        if tick == 21:
            live.reset()
        blow(live, tick)

    path = record(tmp_path / 'bag', SCENE, 41, act)
    assert main([str(path), '--substeps', '40', '--out', str(tmp_path / 'new')]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith('simulated for [s]')
    times = [float(line.split()[0]) for line in lines[1:9]]
    assert times == pytest.approx([5 * part * PERIOD for part in range(1, 9)], abs=0.006)
    # The simulated time of each state, which begins again.
    assert [row[1] for row in rows(tmp_path / 'new')][-1] == pytest.approx(21 * PERIOD)


def test_results_that_exist_are_kept(bag, tmp_path, capsys):
    arguments = [str(bag), '--substeps', '30', '--out', str(tmp_path)]
    assert main(arguments) == 0
    before = (tmp_path / 'error.csv').read_text()
    assert main(arguments) == 2
    assert 'exists already; give another folder with --out' in capsys.readouterr().err
    assert (tmp_path / 'error.csv').read_text() == before


@pytest.mark.slow
def test_ctrl_c_leaves_a_complete_bag(tmp_path):
    path = record(tmp_path / 'bag', SCENE, 3000)
    command = [sys.executable, '-m', 'cloth_ros.recording.main', str(path), '--substeps', '400']
    child = subprocess.Popen(
        [*command, '--out', str(tmp_path / 'out')], cwd=ROOT, stderr=subprocess.PIPE, text=True
    )
    written = tmp_path / 'out/error.csv'
    end = time.monotonic() + 240.0
    while not (written.exists() and written.stat().st_size > 0):
        assert child.poll() is None
        assert time.monotonic() < end
        time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    assert child.wait(60.0) == 130
    assert 'cloth_resimulate: stopped' in child.stderr.read()
    assert run.repeat(tmp_path / 'out/bag', None, lambda *_: None).identical


@pytest.mark.slow
def test_a_folder_of_bags_on_dask(tmp_path, capfd):
    for name in ('first', 'second'):
        record(tmp_path / 'bags' / name, SCENE, 30, blow)
    assert main([str(tmp_path / 'bags'), '--out', str(tmp_path / 'repeated')]) == 0
    printed = capfd.readouterr().out
    for name in ('first', 'second'):
        assert f'{name}: 29 ticks repeated: 29 states' in printed
    (tmp_path / 'bags/third').mkdir()
    (tmp_path / 'bags/third/metadata.yaml').write_text('no bag')
    arguments = [str(tmp_path / 'bags'), '--substeps', '40', '--out', str(tmp_path / 'new')]
    assert main(arguments) == 2
    results = json.loads((tmp_path / 'new/results.json').read_text())
    assert sorted('error' in each for each in results) == [False, False, True]
    assert (tmp_path / 'new/first/error.png').exists()


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_memory_does_not_grow_with_the_bag(tmp_path):
    """An hour of a small sheet takes as much as ten minutes."""
    scene = SCENE.with_parameters({'sheet.rows': 4, 'sheet.columns': 4, 'rate': 4.0})
    peaks = []
    for minutes in (10, 60):
        path = record(tmp_path / f'{minutes}', scene, 240 * minutes)
        script = (
            'import resource, sys; from cloth_ros.recording.main import main; '
            'code = main(sys.argv[1:]); '
            'print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024); sys.exit(code)'
        )
        command = [sys.executable, '-c', script, str(path), '--substeps', '150']
        command += ['--out', str(tmp_path / f'out {minutes}')]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        peaks.append(float(done.stdout.split()[-1]))
        assert len(rows(tmp_path / f'out {minutes}')) == 240 * minutes - 1
    assert peaks[1] < peaks[0] + 16, peaks  # MB
