"""
Compiled kernels on disk: kept for the next start, and never an obstacle.

Each call of `start` runs a script that makes a kernel, as a new process would: nothing compiled is
in memory.
"""

import resource
import runpy
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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
    return x + {}

@exact
def other(x):
    return x - {}
"""
UNLIMITED = 2**30


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """Let files end after so many bytes, as they do on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def start(tmp_path, monkeypatch) -> Callable[..., SimpleNamespace]:
    """Run the script with a number in its kernels; return results, cache hits and warnings."""
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path / 'cache'))
    script = tmp_path / 'script.py'

    def run(number: int, argument: float = 1.0, *, limit: int = UNLIMITED) -> SimpleNamespace:
        if not script.exists() or script.read_text() != SCRIPT.format(number, number):
            script.write_text(SCRIPT.format(number, number))
        jit._warn.cache_clear()
        with warnings.catch_warnings(record=True) as caught, largest_file(limit):
            warnings.simplefilter('always')
            names = runpy.run_path(str(script))
            kernels = [names['kernel'], names['other']]
            results = [kernel(argument) for kernel in kernels]
        hits = sum(sum(kernel.stats.cache_hits.values()) for kernel in kernels)
        texts = [str(warning.message) for warning in caught]
        return SimpleNamespace(results=results, hits=hits, warnings=texts)

    return run


def kept(folder: Path, kind: str = 'nb?') -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob(f'*.{kind}')}


def test_a_full_disk_is_reported_once_and_leaves_no_outdated_kernel(start, tmp_path):
    assert start(1).results == [2.0, 0.0]
    assert start(1).hits == 2
    # The index of the cache does not fit on the disk; then it does, but not the kernel.
    for number, limit in ((2, 16), (3, 2048)):
        full = start(number, limit=limit)
        assert full.results == [1.0 + number, 1.0 - number]
        assert len(full.warnings) == 1
        assert 'set NUMBA_CACHE_DIR' in full.warnings[0]
        assert not list(tmp_path.rglob('*.tmp.*'))
        roomy = start(number)
        assert (roomy.results, roomy.hits, roomy.warnings) == (full.results, 0, [])
        assert start(number).hits == 2
    assert len(kept(tmp_path, 'nbc')) == 2  # code of older sources was removed


@pytest.mark.parametrize('kind', ['nbi', 'nbc'])
@pytest.mark.parametrize('left', [0, 100])
def test_files_that_cannot_be_read_are_compiled_again(start, tmp_path, kind, left):
    """As after a loss of power."""
    start(1)
    for path, content in kept(tmp_path, kind).items():
        path.write_bytes(content[:left])
    found = start(1)
    assert found.results == [2.0, 0.0]
    assert len(found.warnings) == 1
    assert 'cannot be read' in found.warnings[0]
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
    for argument in (1, 1.0):
        (result, _) = start(1, argument).results
        assert (result, type(result)) == (2, type(argument))


def test_a_change_of_any_source_of_the_model_outdates_all_kernels(start, tmp_path, monkeypatch):
    """Forces are inlined into kernels of other files."""
    model = tmp_path / 'model'
    shutil.copytree(ROOT / 'cloth_ros/model', model)
    monkeypatch.setattr(jit, '__file__', str(model / 'kernels/jit.py'))
    for change in ('', '# another source'):
        with (model / 'forces/springs.py').open('a') as source:
            source.write(change)
        jit._sources.cache_clear()
        assert start(1).hits == 0
        assert start(1).hits == 2
    monkeypatch.undo()
    jit._sources.cache_clear()


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
