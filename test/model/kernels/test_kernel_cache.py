"""Compiled kernels on disk: kept for the next start, and never an obstacle."""

import resource
import runpy
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numba
import pytest
from builders import ROOT

from cloth_ros.model.kernels import jit

SCRIPT = """
from cloth_ros.model.kernels.jit import exact

@exact
def kernel(x):
    return x + {0}

@exact
def other(x):
    return x - {0}
"""


@pytest.fixture
def start(tmp_path, monkeypatch) -> Iterator[Callable[..., SimpleNamespace]]:
    """
    Run a script with a number in its kernels; return results, cache hits and warnings.

    As in a new process: nothing compiled is in memory.  Files end after `limit` bytes, as they do
    on a full disk.
    """
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path / 'cache'))
    script, (usual, most) = tmp_path / 'script.py', resource.getrlimit(resource.RLIMIT_FSIZE)

    def run(number: int, argument: float = 1.0, *, limit: int = usual) -> SimpleNamespace:
        if not script.exists() or script.read_text() != SCRIPT.format(number):
            script.write_text(SCRIPT.format(number))
        jit._warn.cache_clear()
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter('always')
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
            names = runpy.run_path(str(script))
            kernels = [names['kernel'], names['other']]
            results = [kernel(argument) for kernel in kernels]
            resource.setrlimit(resource.RLIMIT_FSIZE, (usual, most))
        hits = sum(sum(kernel.stats.cache_hits.values()) for kernel in kernels)
        # Others, such as ResourceWarning, may come from objects of other tests.
        texts = [str(each.message) for each in caught if each.category is UserWarning]
        return SimpleNamespace(results=results, hits=hits, warnings=texts)

    yield run
    resource.setrlimit(resource.RLIMIT_FSIZE, (usual, most))


def kept(folder: Path, kind: str = 'nb?') -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob(f'*.{kind}')}


def test_a_full_disk_is_reported_once_and_leaves_no_outdated_kernel(start, tmp_path):
    assert (start(1).results, start(1).hits) == ([2.0, 0.0], 2)
    # The index of the cache does not fit on the disk; then it does, but not the kernel.
    for number, limit in ((2, 16), (3, 2048)):
        full = start(number, limit=limit)
        assert full.results == [1.0 + number, 1.0 - number]
        assert ['set NUMBA_CACHE_DIR' in text for text in full.warnings] == [True]
        assert not list(tmp_path.rglob('*.tmp.*'))
        roomy = start(number)
        assert (roomy.results, roomy.hits, roomy.warnings) == (full.results, 0, [])
        assert start(number).hits == 2
    assert len(kept(tmp_path, 'nbc')) == 2  # code of older sources was removed


@pytest.mark.parametrize('kind', ['nbi', 'nbc'])
@pytest.mark.parametrize('left', [0, 100])
def test_files_damaged_by_a_loss_of_power_are_compiled_again(start, tmp_path, kind, left):
    start(1)
    for path, content in kept(tmp_path, kind).items():
        path.write_bytes(content[:left])
    found = start(1)
    assert found.results == [2.0, 0.0]
    assert ['cannot be read' in text for text in found.warnings] == [True]
    again = start(1)
    assert (again.hits, again.warnings) == (2, [])


def test_code_of_another_process_is_not_mistaken_for_the_own(start, tmp_path):
    """Two processes find no cache; one writes index and code before the other writes its code."""
    start(1, 1.0)
    late = kept(tmp_path)
    for path in late:
        path.unlink()
    start(1, 1)
    for path, code in late.items():
        if path.suffix == '.nbc':
            path.write_bytes(code)
    assert [repr(start(1, argument).results[0]) for argument in (1, 1.0)] == ['2', '2.0']


def test_a_change_of_any_source_of_the_model_outdates_all_kernels(start, tmp_path, monkeypatch):
    """Forces are inlined into kernels of other files."""
    shutil.copytree(ROOT / 'cloth_ros/model', tmp_path / 'model')
    monkeypatch.setattr(jit, '__file__', str(tmp_path / 'model/kernels/jit.py'))
    monkeypatch.setattr(jit, '_sources', jit._sources.__wrapped__)
    for change in ('', '# another source'):
        with (tmp_path / 'model/forces/springs.py').open('a') as source:
            source.write(change)
        assert [start(1).hits, start(1).hits] == [0, 2]


# The root again, read-only, in a mount namespace of its own.
ENTER = (
    *('unshare', '-rm', 'sh', '-c'),
    'mount --rbind / /mnt && mount -o remount,ro,bind /mnt && exec chroot /mnt "$@"',
    'sh',
)


def test_the_model_works_where_nothing_can_be_written_and_reports_it_once():
    tried = shutil.which('unshare') and subprocess.run(
        [*ENTER, 'test', '!', '-w', ROOT], capture_output=True
    )
    if not tried or tried.returncode:
        pytest.skip('this file system cannot be mounted read-only')
    command = ['env', '-C', ROOT, 'HOME=/nowhere', sys.executable, '-c', 'import cloth_ros.model']
    found = subprocess.run([*ENTER, *command], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert found.stderr.count('set NUMBA_CACHE_DIR') == 1
