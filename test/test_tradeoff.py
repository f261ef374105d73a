"""The command cloth_tradeoff, on sheets that take seconds."""

import copy
import json
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from cloth_ros.tradeoff.reference import horizon, reference_setting, time_together

from cloth_ros import Scene
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff import cache, plot, recommendation, report
from cloth_ros.tradeoff.cache import Cache
from cloth_ros.tradeoff.main import main
from cloth_ros.tradeoff.run import Scenario, simulate
from cloth_ros.tradeoff.schedule import Options, Schedule
from cloth_ros.tradeoff.settings import FixedStepCloth, least_substeps, make_cloth, plan
from cloth_ros.tradeoff.study import Study

SCENE = """
/**:
  ros__parameters:
    sheet: {rows: 12, columns: 12, position: [0.0, 0.0, 1.5]}
"""


@pytest.fixture(scope='module')
def scene_path(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp('scene') / 'small.yaml'
    path.write_text(SCENE)
    return path


@pytest.fixture(scope='module')
def study(scene_path, tmp_path_factory) -> tuple[Path, dict]:
    """A finished quick study, and its folder."""
    out = tmp_path_factory.mktemp('out')
    assert main([str(scene_path), '--quick', '--seconds', '0.4', '--out', str(out)]) == 0
    return out / 'small', json.loads((out / 'small' / 'result.json').read_text())


def test_the_output_is_complete(study):
    folder, result = study
    picture = matplotlib.image.imread(folder / 'work_precision.png')
    assert picture.std() > 0.05
    drawing = (folder / 'work_precision.svg').read_text()
    assert ElementTree.fromstring(drawing).tag.endswith('svg')
    page = (folder / 'report.md').read_text()
    for heading in ('Settings', 'Rate', 'Grid', 'Where the methods break', 'Energy', 'live error'):
        assert heading in page
    assert '60 Hz on this machine' in page
    assert '0.1 mm' in page
    for entry in result['settings']:
        assert entry['label'] in page
    for name in ('processor', 'numba', 'cloth_ros', 'python'):
        assert result['machine'][name] in page


def test_the_reference_is_ten_times_better_than_the_smallest_error(study):
    _, result = study
    reference = result['reference']
    assert reference['horizon'] == pytest.approx(0.4)
    entries = [*result['settings'], *result['rates']]
    errors = [entry['error']['largest'] for entry in entries if entry['error']]
    assert reference['smallest error'] <= min(errors)
    assert reference['agreement'] <= 0.1 * min(errors)


def test_errors_fall_with_the_order_of_the_method(study):
    _, result = study
    errors = {
        (entry['setting']['method'], entry['setting']['substeps']): entry['error']['largest']
        for entry in result['settings']
        if entry['error']
        and entry['setting']['precision'] == 'double'
        and entry['setting']['substeps']
    }
    scene = Scene(**{'sheet': {'rows': 12, 'columns': 12}})
    for name, method in INTEGRATORS.items():
        least = least_substeps(scene, name)
        found = errors[name, least] / errors[name, 2 * least]
        assert found == pytest.approx(2**method.order, rel=0.25)


def test_settings_that_blow_up_are_shown_and_not_recommended(study, tmp_path):
    folder, result = study
    unstable = [entry for entry in result['settings'] if entry['unstable']]
    assert unstable
    assert all(entry['refused'] for entry in unstable)
    assert (folder / 'report.md').read_text().count('**blew up**') == len(unstable)
    chosen = [recommendation.for_real_time(result), recommendation.for_accuracy(result)]
    assert None not in chosen
    for entry in [*chosen, {**chosen[0], 'setting': {**chosen[0]['setting'], 'tolerance': 1e-5}}]:
        assert not entry['refused']
        # What is recommended can be used as it is written, and heeds fast motion.
        scene = tmp_path / 'scene.yaml'
        scene.write_text(f'/**:\n  ros__parameters:\n    {recommendation.parameters(entry)}\n')
        solver = Scene.from_yaml(scene).solver
        assert solver.substeps == 0
        assert solver.tolerance == entry['setting']['tolerance']


def test_of_tolerances_with_the_same_substeps_the_least_is_recommended(study):
    _, result = study
    chosen = recommendation.usable(result)
    assert chosen
    for entry in recommendation.candidates(result):
        if entry['setting']['substeps'] == 0:
            alike = [
                each
                for each in chosen
                if each['setting']['precision'] == entry['setting']['precision']
                and each['substeps per tick'] == pytest.approx(entry['substeps per tick'])
            ]
            assert alike
            assert alike[0]['setting']['tolerance'] <= entry['setting']['tolerance']


def test_where_no_error_is_known_that_is_said_and_shown(study, tmp_path):
    _, result = study
    unknown = copy.deepcopy(result)
    unknown['reference'].update({'horizon': 0.0, 'apart': [{'distance': 1e-3, 'time': 0.1}]})
    for entry in (*unknown['settings'], *unknown['rates']):
        entry['error'] = None
    plot.draw(unknown, tmp_path)
    assert matplotlib.image.imread(tmp_path / 'work_precision.png').std() > 0.01
    page = report.page(unknown)
    assert 'No error is known' in page
    assert 'differs from the start' in page
    assert 'no setting takes less' not in page


def test_the_time_left_is_that_of_all_parts(study, scene_path):
    """A finished study is run through again, which takes no time and reports all of it."""
    folder, result = study
    scene, kept = Scene.from_yaml(scene_path), Cache(folder / 'parts')
    told: list[float] = []
    study_again = Study(
        'small',
        scene,
        Schedule(scene, Options(quick=True, seconds=0.4, arrival=0.3), kept),
        kept,
        lambda text, seconds: told.append(0.0 if text else seconds),
    )
    again = study_again.run()
    assert sum(told) == pytest.approx(study_again.expected)
    assert json.loads(json.dumps(again)) == {
        **result,
        'settings': again['settings'],  # but for what they were expected to cost
        'rates': again['rates'],
    }


def test_the_study_begins_just_before_the_first_gust_if_that_comes_soon(tmp_path):
    def begins(period: float) -> tuple[float, bool, bool]:
        scene = Scene(
            sheet={'rows': 4, 'columns': 4}, wind={'gust': {'period': period, 'duration': 0.01}}
        )
        schedule = Schedule(scene, Options(quick=True, seconds=0.1), Cache(tmp_path))
        return schedule.begins, schedule.still, schedule.scenario.start is not None

    assert begins(2.0) == (pytest.approx(1.9), False, True)
    assert begins(0.05) == (0.0, False, False)
    assert begins(30.0) == (0.0, True, False)


def test_parts_that_are_broken_or_of_other_code_are_measured_again(tmp_path, monkeypatch):
    kept = Cache(tmp_path)
    key = {'part': 'x'}
    kept.save(key, {'a': 1}, np.arange(3.0))
    result, array = kept.load(key)
    assert result == {'a': 1}
    assert np.array_equal(array, np.arange(3.0))
    (record,), (data,) = tmp_path.glob('*.json'), tmp_path.glob('*.npy')
    whole = record.read_bytes(), data.read_bytes()
    for text, numbers in ((b'{}', whole[1]), (b'', whole[1]), (whole[0], b''), (b'[]', whole[1])):
        record.write_bytes(text)
        data.write_bytes(numbers)
        assert kept.load(key) is None
    record.write_bytes(whole[0])
    data.write_bytes(whole[1])
    assert kept.load(key) is not None
    monkeypatch.setattr(cache, '_fingerprint', lambda: 'of other code')
    assert kept.load(key) is None


def test_the_frontier_is_what_nothing_beats(study):
    _, result = study
    entries = recommendation.candidates(result)
    best = recommendation.frontier(entries)
    for entry in entries:
        beaten = any(
            recommendation.cost(other) <= recommendation.cost(entry)
            and recommendation.error(other) <= recommendation.error(entry)
            for other in entries
            if other is not entry
        )
        assert (entry in best) != beaten


def test_costs_and_counts_are_of_the_run(study):
    _, result = study
    for entry in result['settings']:
        if entry['unstable']:
            continue
        wall, substeps = entry['wall'], entry['substeps per tick']
        assert 0 < wall['least'] <= wall['median'] <= wall['greatest']
        assert entry['particle steps'] == pytest.approx(substeps * 60 * 144, rel=1e-3)
        if entry['setting']['substeps']:
            assert substeps == pytest.approx(entry['setting']['substeps'])


def test_grids_come_nearer_to_the_finest(study):
    _, result = study
    distances = [entry['rms'] for entry in result['grids']]
    assert [entry['rows'] for entry in result['grids']] == [4, 7, 12, 23]
    assert distances[-1] == 0
    assert distances[0] > distances[2] > 0


def test_a_study_that_is_stopped_goes_on_where_it_was(scene_path, tmp_path):
    command = [sys.executable, '-m', 'cloth_ros.tradeoff.main', str(scene_path), '--quick']
    command += ['--seconds', '0.2', '--out', str(tmp_path)]
    parts = tmp_path / 'small' / 'parts'
    # In a session of its own: the signal is for it alone.
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 120
    while len(list(parts.glob('*.json'))) < 6 and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, output + errors
    assert 'the same command goes on from here' in errors
    assert 'Traceback' not in errors
    before = {path: path.stat().st_mtime_ns for path in parts.glob('*.json')}
    assert len(before) >= 6
    assert not (tmp_path / 'small' / 'result.json').exists()
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    after = {path: path.stat().st_mtime_ns for path in parts.glob('*.json')}
    assert len(after) > len(before)
    assert {path: after[path] for path in before} == before
    assert (tmp_path / 'small' / 'result.json').exists()


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (['missing.yaml'], 'missing.yaml: No such file'),
        (['{bad}'], 'sheet.rows'),
        (['{pinned}'], 'every particle is pinned'),
        (['{loose}'], 'without springs'),
        (['{good}', '--seconds', '-1'], '--seconds is -1'),
        (['{good}', '--seconds', 'nan'], '--seconds is nan'),
        (['{good}', '--over', '0'], '--over is 0'),
        (['{good}', '--sphere', '0', '0', 'inf'], '--sphere'),
        (['{good}', '{good}'], 'two scenes are called'),
        (['{good}', '--out', '{file}'], 'file'),
        (['{good}', '--fast'], '--fast'),
        (['{good}', '--seconds', 'long'], "'long'"),
        (['{good}', '--sphere', '0', '0'], 'expected 3'),
        ([], 'SCENE'),
    ],
)
def test_nonsense_is_refused_in_one_line(arguments, said, tmp_path, capsys, monkeypatch):
    head = '/**:\n  ros__parameters:\n'
    texts = {
        'good': SCENE,
        'bad': head + '    sheet: {rows: 0}\n',
        'pinned': head + '    pins: [":,:"]\n',
        'loose': head + '    springs: {structural: 0.0, shear: 0.0, bending: 0.0}\n',
        'file': 'not a folder',
    }
    names = {}
    for name, text in texts.items():
        names[name] = tmp_path / f'{name}.yaml'
        names[name].write_text(text)
    monkeypatch.chdir(tmp_path)
    filled = [argument.format(**names) for argument in arguments]
    try:
        code = main([*filled, '--quick'])
    except SystemExit as end:  # by argparse
        code = end.code
    assert code == 2
    error = capsys.readouterr().err
    assert error.count('\n') == 1
    assert said in error
    assert error.startswith('cloth_tradeoff: ')


def test_the_horizon_ends_where_the_levels_of_the_reference_part():
    between = np.array([1e-12, 1e-6, 1e-5, 1e-2, 1e-6])
    error = np.array([1e-9, 1e-4, 1e-3, 1e-2, 1e-2])
    found = horizon(between, [error, 10 * error])
    assert found.samples == 3
    assert found.agreement == 1e-5
    assert found.smallest_error == 1e-3
    assert horizon(between, [0 * error]).samples == 1


def test_time_together_ends_at_a_hundredth_of_the_sheet():
    times = np.array([0.1, 0.2, 0.3])
    assert time_together(np.array([0.0, 0.02, 0.0]), times, 1.0) == 0.2
    assert time_together(np.zeros(3), times, 1.0) == 0.3
    assert time_together(np.zeros(0), times, 1.0) == 0.0


def test_a_fixed_step_is_taken_as_it_is_stable_or_not():
    scene = Scene(sheet={'rows': 6, 'columns': 6})
    for setting in plan(scene, quick=False):
        cloth = make_cloth(scene, setting)
        assert isinstance(cloth, FixedStepCloth) == (setting.substeps > 0)
        if setting.substeps:
            cloth.advance(1 / 60)
            assert cloth.substeps == setting.substeps


def test_every_setting_begins_alike_and_the_sphere_goes_where_it_is_sent():
    scene = Scene.from_yaml('config/small_fast_sphere.yaml').with_parameters(
        {'sheet.rows': 8, 'sheet.columns': 8}
    )
    start = make_cloth(scene, reference_setting(scene, 1))
    start.advance(0.1)
    scenario = Scenario(0.2, 1 / 30, start, goal=(0.1, 0.0, 1.2), arrival=0.1)
    for setting in plan(scene, quick=True)[1::4]:
        cloth = make_cloth(scene, setting)
        next(scenario.ticks(cloth))
        np.testing.assert_allclose(cloth.positions, start.positions, atol=1e-6)
        assert cloth.time == start.time
        simulate(cloth, scenario)
        np.testing.assert_allclose(cloth.sphere_position, (0.1, 0.0, 1.2), atol=1e-12)
