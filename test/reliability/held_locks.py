"""Locks in the shared memory of Fast DDS, and how to stop a process while it holds one."""

from __future__ import annotations

import os
import random
import re
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from ros import PATIENCE

_READER = re.compile(r'dds\.shm\.(\d+)$')  # name of a thread that receives
_WORD = 4  # bytes
# Words of a mutex of glibc, in this order: its state (0: free), a count, and the holding thread.
_OWNER = 2


def message_ports(pid: int) -> list[Path]:
    """
    Return the shared memory through which a process may receive messages.

    By the standard of DDS their numbers are odd; those of the ports for discovery are even.
    """
    names = [each.read_text() for each in Path(f'/proc/{pid}/task').glob('*/comm')]
    ports = [int(found[1]) for each in names if (found := _READER.match(each))]
    return [Path(f'/dev/shm/fastrtps_port{each}') for each in ports if each % 2]


def holds_a_lock(pid: int, ports: list[Path]) -> bool:
    """Return whether a thread of a stopped process holds a lock there."""
    threads = [int(each) for each in os.listdir(f'/proc/{pid}/task')]
    for port in ports:
        content = port.read_bytes()
        words = np.frombuffer(content[: len(content) // _WORD * _WORD], np.uint32)
        held = (words[:-_OWNER] == 1) | (words[:-_OWNER] == 2)
        if (held & np.isin(words[_OWNER:], threads)).any():
            return True
    return False


def wait_until_stopped(pid: int) -> None:
    """Wait until all threads of a process that was sent SIGSTOP have stopped."""
    for thread in Path(f'/proc/{pid}/task').iterdir():
        while (thread / 'stat').read_text().rpartition(')')[2].split()[0] != 'T':
            time.sleep(0)


def stop_holding_a_lock(pid: int, wait: Callable[[float], object]) -> int:
    """
    Stop a process while it holds a lock of shared memory: try until it does.

    Parameters
    ----------
    pid
        Of a process that receives messages through shared memory.
    wait
        Waits for some seconds, while the process runs.

    Returns
    -------
    int
        Number of tries.

    """
    ports, tries, end = message_ports(pid), 1, time.monotonic() + PATIENCE
    while not _stops_holding_a_lock(pid, ports):
        assert time.monotonic() < end, f'in {tries} tries it never held a lock'
        os.kill(pid, signal.SIGCONT)
        wait(random.uniform(0.0, 0.005))  # as it comes: not in step with the messages
        tries += 1
    return tries


def _stops_holding_a_lock(pid: int, ports: list[Path]) -> bool:
    os.kill(pid, signal.SIGSTOP)
    wait_until_stopped(pid)
    return holds_a_lock(pid, ports)
