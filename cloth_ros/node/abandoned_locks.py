"""
Release locks of Fast DDS whose holder is stopped or dead.

What Fast DDS sends to a process on the same machine goes through a port in shared memory: a queue
whose lock senders and reader take for microseconds.  A reader that is stopped or killed in these
makes each sender wait for one to three seconds, with all that it sends to others.  The lock can be
released on behalf of the reader, and again when it goes on: only the reader takes from the queue,
and senders append to it by atomic operations.
"""

from __future__ import annotations

import ctypes
import fcntl
import mmap
import re
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_PORT = re.compile(r'/dev/shm/fastrtps_port\d+$', re.MULTILINE)
_LOCKED_BY_READER = '_el'  # end of the name of a file: of ports with one reader, not of others
_STOPPED = 'Tt'  # by a signal, by a debugger
# Words of a mutex of glibc with 64 bits: its state (0: free), a count, the thread that holds it,
# users, and its kind, here a plain one between processes.
_COUNT, _HOLDER, _KIND = 1, 2, 4
_PLAIN = 0x80


def release_abandoned_locks() -> list[int]:
    """Return the threads that held the locks that were released, by their numbers."""
    if sys.platform != 'linux' or sys.maxsize < 2**32:
        return []
    ports = sorted(set(_PORT.findall(Path('/proc/self/maps').read_text())))
    threads = []
    for port in ports:
        with suppress(OSError, ValueError):  # it is just being made or removed
            threads += release_locks(port)
    return threads


def release_locks(port: str) -> list[int]:
    """
    Release the locks of stopped or dead processes in one port.

    Parameters
    ----------
    port
        File of the port; the name of that which its reader locks begins with it.

    Returns
    -------
    list of int
        The threads that held them, by their numbers.

    """
    if not len(_held(np.frombuffer(Path(port).read_bytes(), np.uint32))):
        return []  # the usual case, which takes a tenth of a millisecond
    with (
        open(port + _LOCKED_BY_READER, 'rb') as reader,
        open(port, 'r+b') as file,
        mmap.mmap(file.fileno(), 0) as memory,
    ):
        words = np.frombuffer(memory, np.uint32)
        threads = []
        for place in _held(words):
            thread = int(words[place + _HOLDER])
            if thread and (_stopped(thread) or _dead(reader.fileno())):
                _unlock(words[place:].ctypes.data)
                threads.append(thread)
        del words  # else the memory could not be closed
    return threads


def _held(words: NDArray[np.uint32]) -> NDArray[np.intp]:
    """Return the indices of the first words of all locks that are held."""
    last = len(words) - _KIND
    plain = np.flatnonzero(words[_KIND:] == _PLAIN)
    held = np.isin(words[:last][plain], (1, 2)) & (words[plain + _COUNT] == 0)
    indices: NDArray[np.intp] = plain[held]
    return indices


def _stopped(thread: int) -> bool:
    try:
        status = Path(f'/proc/{thread}/stat').read_text()
    except OSError:  # it has ended, or is in another container
        return False
    return status.rpartition(')')[2].split()[0] in _STOPPED


def _dead(reader: int) -> bool:
    try:
        fcntl.flock(reader, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True  # closing the file unlocks it


def _unlock(address: int) -> None:
    function = ctypes.CDLL(None).pthread_mutex_unlock
    function.argtypes = (ctypes.c_void_p,)
    function(address)
