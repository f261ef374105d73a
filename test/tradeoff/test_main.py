"""Command line of `cloth_tradeoff`: every error takes one line, and nothing slow is imported."""

import subprocess
import sys

import pytest

from cloth_ros.tradeoff.main import main

FILES = {
    'good': 'sheet: {rows: 4, columns: 4}',
    'bad': 'sheet: {rows: 0}',
    'unstable': 'solver: {substeps: 1}',
    'pinned': 'pins: [":,:"]',
    'loose': 'springs: {structural: 0.0, shear: 0.0, bending: 0.0}',
}
ERRORS = {
    'missing.yaml': 'missing.yaml: No such file',
    'bad': 'sheet.rows',
    'unstable': 'unstable: solver.substeps',
    'pinned': 'all particles are pinned',
    'loose': 'no springs',
    'good --seconds -1': '--seconds is -1',
    'good --seconds nan': '--seconds is nan',
    'good --over 0': '--over is 0',
    'good --over -1e-1': '--over is -0.1, but must be above 0 and at most 60 s; write 1',
    'good --sphere 0 -2E+7 -.5e1': '--sphere is [0.0, -20000000.0, -5.0]',
    'good --sphere 0 0 -inf': '; write --sphere 0.0 0.0 -1000000.0',
    'bad --sphere 0.0 0.0 -1000000.0': 'sheet.rows',  # and no longer the option
    'good --sphere 0 0 inf': '--sphere',
    'good good': 'two scenes have the name',
    'good --out bad': '--out bad',
    'good --fast': '--fast',
    'good --seconds long': "'long'",
    'good --sphere 0 0': 'expected 3',
    '': 'SCENE',
    'good': "scipy is not installed; pip install 'cloth_ros[tradeoff]'",
}


@pytest.mark.parametrize(('arguments', 'text'), ERRORS.items())
def test_an_error_takes_one_line(arguments, text, tmp_path, capsys, monkeypatch):
    for name, content in FILES.items():
        (tmp_path / name).write_text('/**:\n  ros__parameters:\n    ' + content)
    monkeypatch.chdir(tmp_path)
    if arguments == 'good':
        monkeypatch.setattr('importlib.util.find_spec', lambda name: name != 'scipy' or None)
    try:
        code = main(arguments.split())
    except SystemExit as end:  # by argparse
        code = end.code
    error = capsys.readouterr().err
    assert (code, error.count('\n'), error.split(': ')[0]) == (2, 1, 'cloth_tradeoff')
    assert text in error


def test_help_needs_no_slow_import():
    program = (
        'import sys; import cloth_ros.tradeoff.main as m\n'
        'try: m.main(["--help"])\n'
        'except SystemExit: pass\n'
        'print(*{"numba", "matplotlib", "scipy", "tqdm"} & set(sys.modules), file=sys.stderr)'
    )
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True)
    assert ('--quick' in done.stdout, done.stderr.strip()) == (True, '')
