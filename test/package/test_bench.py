"""Benchmarks, a selection that takes seconds: they run, and their report is complete."""

import json
import os
import subprocess
import sys

import pytest
from builders import ROOT

from bench.report import Report, load
from tools.marked_block import marks

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def measured(tmp_path_factory) -> dict:
    path = tmp_path_factory.mktemp('bench') / 'result.json'
    some = 'test_limits or (test_size and 32) or test_effect or 16-numpy'
    some += ' or test_contact and 32 and (hanging or sphere or box)'
    some += ' or test_cloth_ros and 16'
    command = [sys.executable, '-m', 'pytest', 'bench', '-q', f'--benchmark-json={path}']
    # pytest-benchmark measures nothing where this variable says that tests run in parallel.
    environment = {k: v for k, v in os.environ.items() if k != 'PYTEST_XDIST_WORKER'}
    done = subprocess.run(
        [*command, '-k', some, '-p', 'no:cacheprovider'],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return load(path)


def test_report_has_all_sections(measured, tmp_path):
    report = Report(measured)
    assert report.limit() > 0
    text = report.text()
    for heading in ('Cost by size', 'limit of the processor', 'Cost of each', 'other engines'):
        assert heading in text
    for row in ('| hanging, ns |', '| lying on sphere |', '| falling on box |', 'On a box:'):
        assert row in text
    assert '32 × 32' in text
    assert 'NumPy' in text
    readme = tmp_path / 'README.md'
    begin, end = marks('make bench')
    readme.write_text(f'before\n{begin}\nold\n{end}\nafter\n')
    report.insert(readme)
    assert 'old' not in readme.read_text()
    assert '| cloth_ros |' in readme.read_text()
    assert readme.read_text().endswith(f'{end}\nafter\n')
    report.draw(tmp_path)
    assert (tmp_path / 'cost.png').stat().st_size > 10_000
    assert (tmp_path / 'cost.svg').read_text().startswith('<?xml')
    # The name of the host is not recorded.
    assert set(measured['machine']) >= {'processor', 'cores', 'numba'}
    assert 'node' not in json.dumps(measured['machine'])
