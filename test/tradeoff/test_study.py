"""One quick study from beginning to end, interrupted once, and what is made of its results."""

import copy
import json
import os
import signal
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import matplotlib.image
import pytest

from cloth_ros import Scene
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff import main as command
from cloth_ros.tradeoff import measured_stability, plot, recommendation, report
from cloth_ros.tradeoff.settings import least_substeps

HEAD = '/**:\n  ros__parameters:\n    '
PARTS = 6  # before the interrupt


@pytest.fixture(scope='module')
def study(tmp_path_factory) -> tuple[Path, dict]:
    """Folder and results of a study, stopped by Ctrl-C and continued by the same command."""
    folder = tmp_path_factory.mktemp('study') / 'small'
    scene = 'sheet: {rows: 12, columns: 12, position: [0.0, 0.0, 1.5]}'
    folder.with_suffix('.yaml').write_text(HEAD + scene)
    arguments = [f'{folder}.yaml', '--quick', '--seconds', '0.4', '--out', str(folder.parent)]
    bar, expect, done, texts = command._Bar.__call__, command._Bar.expect, [], []

    def progress(self, text, seconds):
        texts.append(text)
        done.append(0.0 if text else seconds)
        if len(list(folder.glob('parts/*.json'))) == PARTS:
            os.kill(os.getpid(), signal.SIGINT)
        bar(self, text, seconds)

    def begin(self, seconds):
        done[:] = [-seconds]
        expect(self, seconds)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measured_stability, '_LARGEST', 5)
        patch.setattr(command._Bar, '__call__', progress)
        patch.setattr(command._Bar, 'expect', begin)
        assert command.main(arguments) == 130
        before = {path: path.stat().st_mtime_ns for path in folder.glob('parts/*')}
        assert len(before) == 2 * PARTS  # JSON and array of each part
        assert not (folder / 'result.json').exists()
        patch.setattr(os, 'kill', lambda *_: None)
        assert command.main(arguments) == 0
    assert {path: path.stat().st_mtime_ns for path in before} == before  # not measured again
    assert sum(done) == pytest.approx(0.0, abs=1e-9)  # all that was expected is done
    assert texts[0] == 'compiling'
    assert not any('gust' in text for text in texts)
    return folder, json.loads((folder / 'result.json').read_text())


def test_the_output_is_complete(study):
    folder, result = study
    assert matplotlib.image.imread(folder / 'work_precision.png').std() > 0.05
    drawing = ElementTree.fromstring((folder / 'work_precision.svg').read_text())
    assert drawing.tag.endswith('svg')
    page = (folder / 'report.md').read_text()
    titles = ('Settings', 'Tick rate', 'Grid', 'Stability', 'Energy budget', 'Live error')
    labels = [entry['label'] for entry in result['settings']]
    machine = result['machine'].values()
    for text in (*(f'## {title}' for title in titles), '60 Hz', '0.1 mm', *labels, *machine):
        assert text in page


def test_settings_have_the_errors_and_counts_of_their_runs(study):
    _, result = study
    errors, reference = {}, result['reference']
    entries = [*result['settings'], *result['rates']]
    smallest = min(entry['error']['largest'] for entry in entries if entry['error'])
    assert reference['horizon'] == pytest.approx(0.4)
    assert 10 * reference['agreement'] <= reference['smallest error'] <= smallest
    for entry in result['settings']:
        setting, wall, substeps = entry['setting'], entry['wall'], entry['substeps per tick']
        assert 0 < wall['least'] <= wall['median'] <= wall['greatest']
        if not entry['unstable']:
            assert entry['particle steps'] == pytest.approx(substeps * 60 * 144, rel=1e-3)
            assert substeps == pytest.approx(setting['substeps'] or substeps)
            if setting['precision'] == 'double':
                errors[setting['method'], setting['substeps']] = entry['error']['largest']
    scene = Scene().with_parameters({'sheet.rows': 12, 'sheet.columns': 12})
    for name, integrator in INTEGRATORS.items():
        least = least_substeps(scene, name)
        ratio = errors[name, least] / errors[name, 2 * least]
        assert ratio == pytest.approx(2**integrator.order, rel=0.25)


def test_grids_stability_limits_energy_and_live_error_are_measured(study):
    _, result = study
    grids = result['grids']
    assert [grid['rows'] for grid in grids] == [4, 7, 12, 23]
    assert grids[-1]['rms'] == 0 < grids[2]['rms'] < grids[0]['rms']
    assert result['budget']['closure'] < 0.01
    for row in result['breaking']:
        assert row['taken'] < row['measured'] == pytest.approx(row['predicted'], rel=0.05)
    for each in result['live error']:
        assert each['estimate'] == pytest.approx(each['truth'], rel=1.0)
    assert len(result['live error']) > 1


def test_only_stable_settings_are_recommended_as_a_scene_takes_them(study, tmp_path):
    folder, result = study
    unstable = [entry for entry in result['settings'] if entry['unstable']]
    assert (folder / 'report.md').read_text().count('**blew up**') == len(unstable) > 0
    assert all(entry['refused'] for entry in unstable)
    assert recommendation.usable(result)
    for entry in recommendation.usable(result):
        assert not entry['refused']
        path = tmp_path / 'scene.yaml'
        path.write_text(HEAD + recommendation.parameters(entry))
        solver = Scene.from_yaml(path).solver
        assert (solver.substeps, solver.tolerance) == (0, entry['setting']['tolerance'])


def test_substeps_that_do_not_follow_the_state_are_shown_and_not_recommended(study, tmp_path):
    assert 'The same, here' in report.page(study[1])  # no pair for so small a sheet
    both = copy.deepcopy(study[1])
    own = both['settings'][0]
    other = copy.deepcopy(own)
    other['setting']['follows_state'] = False
    other['substeps per tick'] = 1.25 * own['substeps per tick']
    other['wall'] = {name: value / 2 for name, value in own['wall'].items()}
    both['settings'].append(other)
    assert 'Substeps that are saved: 20 %.' in report.page(both)
    assert other in recommendation.candidates(both)
    assert other not in recommendation.usable(both)
    plot.draw(both, tmp_path)
    assert 'substeps fixed at the bound' in (tmp_path / 'work_precision.svg').read_text()


@pytest.mark.parametrize('horizon', [0.0, 0.1])
def test_where_the_reference_does_not_converge_no_error_is_reported(study, tmp_path, horizon):
    partly = copy.deepcopy(study[1])
    partly['reference'].update(horizon=horizon, apart=[{'distance': 1e-3, 'time': 0.12}])
    partly['course'].update({'begins at': 4.9, 'sphere sent to': [0.0, 0.0, 0.6]})
    if horizon == 0:
        for entry in (*partly['settings'], *partly['rates']):
            entry['error'] = None
    plot.draw(partly, tmp_path)
    assert matplotlib.image.imread(tmp_path / 'work_precision.png').std() > 0.01
    text = 'After 0.1 s' if horizon else 'No error is known'
    for each in (text, '1 mm at 0.12 s', 'from 4.9 s on', 'moves to (0, 0, 0.6) m', 'diverge'):
        assert each in report.page(partly)
