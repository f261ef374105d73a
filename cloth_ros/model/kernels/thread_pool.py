"""
Threads that share the loops of a kernel.

A kernel makes one or more passes over the particles.  Each pass is cut into chunks of the same
particles whatever the number of threads, so that the result has the same bits with any.  Every
thread has a part of the chunks, which it finds in its cache from one pass to the next, and takes
from the others' parts when it is through with its own; a pass begins when all chunks of the one
before are done.  So nobody waits for a thread that the system has not let run yet: with another
load on the machine a team is as fast as one thread, and not slower.  Teams of all sizes share
their threads, so that there are no more of them than the largest has.

Threads claim chunks by tickets: one counter per thread's part, counted up over all passes.
"""

from __future__ import annotations

import functools
import itertools
import os
import threading
from queue import SimpleQueue
from typing import Any
from weakref import WeakSet

import numpy as np
from numba import types

from ..grid import Array
from .atomic import increment, load, replace
from .jit import Kernel, exact, inlined

# Particles in a chunk: 4 µs of springs, and a whole number of vectors of any kind, however the
# compiler unrolls its loops.
CHUNK = 1024
# Counters stand on cache lines of their own: the first counts finished chunks.
_LINE = 8
# Looks at a counter before the processor is offered to others.
_SPINS = 2000
# Further looks, some 0.3 µs each, before a thread goes to sleep.
_YIELDS = 500

_sched_yield = types.ExternalFunction('sched_yield', types.int32())


@inlined
def chunk_length(threads, begin, end):  # type: ignore[no-untyped-def]
    """Return the length of the chunks: one thread alone takes a pass at once."""
    return end - begin if threads == 1 else CHUNK


@inlined
def claim_chunk(counters, thread, threads, chunks, number):  # type: ignore[no-untyped-def]
    """Return a chunk of pass `number` that is from now on this thread's, or -1."""
    for other in range(threads):
        owner = (thread + other) % threads
        first = chunks * owner // threads
        count = chunks * (owner + 1) // threads - first
        index = _LINE * (owner + 1)
        ticket = load(counters, index)
        while ticket < (number + 1) * count:
            found = replace(counters, index, ticket, ticket + 1)
            if found == ticket:
                return first + ticket - number * count
            ticket = found
    return -1


@inlined
def notify(posted, thread):  # type: ignore[no-untyped-def]
    """
    Call the others, from within the kernel.

    They need Python's lock to come, and the caller has just released it; to wait for it is to be
    woken by the system.
    """
    if thread == 0:
        increment(posted, 0)


@inlined
def mark_done(counters):  # type: ignore[no-untyped-def]
    """Note that a claimed chunk is done."""
    increment(counters, 0)


@exact
def wait(counters, chunks, number):  # type: ignore[no-untyped-def]
    """Wait until all chunks of pass `number` are done."""
    spins = 0
    while load(counters, 0) < (number + 1) * chunks:
        spins += 1
        if spins > _SPINS:
            _sched_yield()


@exact
def _expect(posted, taken):  # type: ignore[no-untyped-def]
    """Wait a little for a task: being woken by the system takes longer than a pass."""
    spins = 0
    while load(posted, 0) == taken and spins < _SPINS + _YIELDS:
        spins += 1
        if spins > _SPINS:
            _sched_yield()


_Task = tuple[int, Kernel, Array, Array, int, int, tuple[Any, ...]]

# Those of all threads there are besides the callers of teams.
_queues: list[SimpleQueue[_Task]] = []
_growth = threading.Lock()
_teams: WeakSet[ThreadPool] = WeakSet()


def _work(tasks: SimpleQueue[_Task]) -> None:
    while True:
        call, kernel, posted, counters, thread, threads, arguments = tasks.get()
        kernel(posted, counters, thread, threads, *arguments)
        del kernel, counters, arguments  # they are a cloth's, which may end while this waits
        # The next task is most likely of the same team.
        _expect(posted, call)


def _queues_of(count: int) -> list[SimpleQueue[_Task]]:
    """Return the queues of so many threads, which are started unless they run already."""
    with _growth:
        while len(_queues) < count:
            tasks: SimpleQueue[_Task] = SimpleQueue()
            try:
                threading.Thread(target=_work, args=(tasks,), daemon=True).start()
            except RuntimeError:  # there are no more to be had; any number will do
                break
            _queues.append(tasks)
        return _queues[:count]


class ThreadPool:
    """A number of threads, the caller's among them."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._posted = np.zeros(1, np.int64)
        self._calls = itertools.count(1)  # which threads can share, as they cannot an integer
        self._tasks = _queues_of(threads - 1)
        _teams.add(self)

    def go_alone(self) -> None:
        """Wait for no other thread from here on."""
        self._tasks = []

    def run(self, kernel: Kernel, *arguments: Any) -> None:
        """Run ``kernel(posted, counters, thread, threads, *arguments)`` in all, to its end."""
        # New counters: a thread that comes late must find those of its own call used up.
        counters = np.zeros(_LINE * (self.threads + 1), np.int64)
        call, posted = next(self._calls), self._posted
        for number, tasks in enumerate(self._tasks, 1):
            tasks.put((call, kernel, posted, counters, number, self.threads, arguments))
        kernel(posted, counters, 0, self.threads, *arguments)


@functools.cache
def shared_thread_pool(threads: int) -> ThreadPool:
    """Return the team of this size, which all cloths share."""
    return ThreadPool(threads)


def _after_fork() -> None:
    """Threads do not come along into a forked process: teams that there were go on alone."""
    _queues.clear()
    shared_thread_pool.cache_clear()
    for team in _teams:
        team.go_alone()


os.register_at_fork(after_in_child=_after_fork)
