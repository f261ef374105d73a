"""A machine on which nothing can be written."""

import shutil
import subprocess
import sys

import pytest
from conftest import ROOT

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
