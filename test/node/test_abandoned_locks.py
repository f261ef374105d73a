"""Locks in shared memory: only those of processes that are stopped or dead are released."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from ros import Process

from cloth_ros.node.abandoned_locks import release_locks

# A process that holds a lock, as a subscriber does: a mutex between processes in a file, and the
# file that its reader locks.
HOLDER = """
import ctypes, fcntl, mmap, sys, time
libc = ctypes.CDLL(None)
reader = open(sys.argv[1] + '_el', 'w')
fcntl.flock(reader, fcntl.LOCK_EX)
with open(sys.argv[1], 'w+b') as file:
    file.truncate(4096)
    memory = mmap.mmap(file.fileno(), 4096)
kind = (ctypes.c_char * 64)()
libc.pthread_mutexattr_init(kind)
libc.pthread_mutexattr_setpshared(kind, 1)
mutex = (ctypes.c_char * 64).from_buffer(memory, 1024)
libc.pthread_mutex_init(mutex, kind)
libc.pthread_mutex_lock(mutex)
print('held', flush=True)
while libc.pthread_mutex_trylock(mutex):
    time.sleep(0.01)
print('released', flush=True)
time.sleep(1000)
"""


@pytest.fixture
def holder(tmp_path):
    process = Process((sys.executable, '-c', HOLDER, str(tmp_path / 'port')), dict(os.environ))
    process.wait_for_output('held')
    yield process
    process.stop(signal.SIGKILL)


def wait_until_stopped(process: Process) -> None:
    stat = Path(f'/proc/{process.process.pid}/stat')
    while stat.read_text().rpartition(')')[2].split()[0] != 'T':
        time.sleep(0.01)


def test_of_a_process_that_runs(holder, tmp_path):
    assert release_locks(str(tmp_path / 'port')) == []
    assert 'released' not in holder.output


def test_of_a_process_that_is_stopped(holder, tmp_path):
    holder.process.send_signal(signal.SIGSTOP)
    wait_until_stopped(holder)
    assert release_locks(str(tmp_path / 'port')) == [holder.process.pid]
    assert release_locks(str(tmp_path / 'port')) == []
    holder.process.send_signal(signal.SIGCONT)
    holder.wait_for_output('released')


def test_of_a_process_that_was_killed(holder, tmp_path):
    holder.stop(signal.SIGKILL)
    assert release_locks(str(tmp_path / 'port')) == [holder.process.pid]
    assert release_locks(str(tmp_path / 'port')) == []
