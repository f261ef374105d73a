"""A machine on which nothing, or nothing more, can be written."""

import os
import shutil
import subprocess
import sys

import pytest
from ros import ROOT

# The root again, read-only, in a mount namespace of our own.
_ENTER = (
    'unshare',
    '-rm',
    'sh',
    '-c',
    'mount --rbind / /mnt && mount -o remount,ro,bind /mnt && exec chroot /mnt "$@"',
    'sh',
)


def test_the_model_runs_without_a_cache_and_says_so():
    tried = shutil.which('unshare') and subprocess.run(
        [*_ENTER, 'test', '!', '-w', ROOT], capture_output=True
    )
    if not tried or tried.returncode:
        pytest.skip('this file system cannot be mounted read-only')
    command = ['env', '-C', ROOT, 'HOME=/nowhere', sys.executable, '-c']
    found = subprocess.run(
        [*_ENTER, *command, 'import cloth_ros.model'], capture_output=True, text=True
    )
    assert found.returncode == 0, found.stderr
    assert found.stderr.count('set NUMBA_CACHE_DIR') == 1


# A cloth, and a kernel, where files end after so many bytes, as they do on a full disk.
_LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
"""
_CLOTH = """
from cloth_ros import Cloth, Scene
cloth = Cloth(Scene().with_parameters({'sheet.rows': 4, 'sheet.columns': 4}))
cloth.advance(0.1)
"""
_KERNEL = """
from cloth_ros.model.kernels.jit import exact
@exact
def kernel(x):
    return x + {}
print(kernel(1.0))
"""


@pytest.fixture
def run_limited(tmp_path):
    script = tmp_path / 'script.py'

    def run(text: str, limit: int) -> subprocess.CompletedProcess[str]:
        if not script.exists() or script.read_text() != _LIMITED + text:
            script.write_text(_LIMITED + text)  # and what is kept of it is out of date
        return subprocess.run(
            [sys.executable, script, str(limit)],
            env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path), 'PYTHONPATH': str(ROOT)},
            capture_output=True,
            text=True,
        )

    return run


def test_a_full_disk_is_no_end(run_limited, tmp_path):
    found = run_limited(_CLOTH, 1024)
    assert found.returncode == 0, found.stderr
    assert found.stderr.count('set NUMBA_CACHE_DIR') == 1
    assert 'Traceback' not in found.stderr
    assert not list(tmp_path.rglob('*.tmp.*'))


@pytest.mark.parametrize('limit', [16, 2048])  # the index does not fit; it does, the kernel not
def test_a_kernel_that_found_no_room_is_not_mistaken_for_an_older_one(
    run_limited, limit, tmp_path
):
    def kept() -> dict[object, int]:
        return {path: path.stat().st_mtime_ns for path in tmp_path.rglob('*.nb?')}

    assert run_limited(_KERNEL.format(1), 2**30).stdout == '2.0\n'
    assert kept()
    full = run_limited(_KERNEL.format(2), limit)
    assert (full.returncode, full.stdout) == (0, '3.0\n'), full.stderr
    roomy = run_limited(_KERNEL.format(2), 2**30)
    assert (roomy.stdout, roomy.stderr) == ('3.0\n', '')
    before = kept()
    assert run_limited(_KERNEL.format(2), 2**30).stdout == '3.0\n'
    assert kept() == before


@pytest.mark.parametrize('kind', ['nbi', 'nbc'])
@pytest.mark.parametrize('left', [0, 100])
def test_kept_kernels_that_cannot_be_read_are_compiled_anew(run_limited, tmp_path, kind, left):
    """What a power cut may leave."""
    assert run_limited(_KERNEL.format(1), 2**30).stdout == '2.0\n'
    for path in tmp_path.rglob(f'*.{kind}'):
        path.write_bytes(path.read_bytes()[:left])
    found = run_limited(_KERNEL.format(1), 2**30)
    assert (found.returncode, found.stdout) == (0, '2.0\n'), found.stderr
    assert found.stderr.count('cannot be read') == 1
    again = run_limited(_KERNEL.format(1), 2**30)
    assert (again.stdout, again.stderr) == ('2.0\n', '')


def test_code_is_not_mistaken_for_that_of_another_process(run_limited, tmp_path):
    """Both find nothing kept; the second writes its index and code before the first its code."""
    text = _KERNEL.format(1).replace('(1.0)', '(int(sys.argv[1]) % 2 or 1.0)')
    of_a_float, of_a_whole_number = 2**30, 2**30 + 1
    assert run_limited(text, of_a_float).stdout == '2.0\n'
    late = {path: path.read_bytes() for path in tmp_path.rglob('*.nb?')}
    for path in late:
        path.unlink()
    assert run_limited(text, of_a_whole_number).stdout == '2\n'
    for path, code in late.items():
        if path.suffix == '.nbc':
            path.write_bytes(code)
    assert run_limited(text, of_a_whole_number).stdout == '2\n'
    assert run_limited(text, of_a_float).stdout == '2.0\n'


def test_code_of_an_older_source_is_removed(run_limited, tmp_path):
    for number in range(3):
        run_limited(_KERNEL.format(number), 2**30)
    assert len(list(tmp_path.rglob('*.nbc'))) == 1


def test_a_kernel_is_compiled_anew_when_what_it_is_made_of_has_changed(tmp_path):
    """Forces are inlined into kernels that stand in other files."""
    package = tmp_path / 'cloth_ros'
    shutil.copytree(ROOT / 'cloth_ros', package, ignore=shutil.ignore_patterns('__pycache__'))
    environment = {**os.environ, 'PYTHONPATH': str(tmp_path), 'NUMBA_CACHE_DIR': str(tmp_path)}
    command = [sys.executable, '-c', _CLOTH + 'print(cloth.positions[-1, -1])']

    def corner() -> str:
        found = subprocess.run(
            command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return found.stdout

    before = corner()
    springs = package / 'model' / 'springs.py'
    text = springs.read_text()
    assert corner() == before
    springs.write_text(text.replace('kl * root - k\n', 'kl * root - k - k\n'))
    assert springs.read_text() != text
    assert corner() != before
