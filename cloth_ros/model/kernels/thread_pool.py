"""
Thread pool for the loops of a kernel.

A kernel makes one or more loops over the particles.  Each loop is cut into chunks, the same ones
for every number of threads, so that the result has the same bits with any number.  Each thread
owns a part of the chunks, which stays in its cache from one loop to the next, and takes chunks of
the other threads when its own are done.  A loop begins when all chunks of the one before are done.
So no thread waits for one that the system has not scheduled yet: beside another load a pool is as
fast as one thread, not slower.  Pools of all sizes share their threads.

Two threads at 128 × 128 take 2.8 to 3.7 ns per particle and substep with this pool, and 3.9 ns
with Numba's `prange`, which launches its threads in each loop.

Threads claim chunks by tickets: one counter per thread, for its part of the chunks, counts up over
all loops.
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
from .atomic import compare_exchange, fetch_add, load
from .jit import Kernel, exact, exact_subroutine, inlined

# Particles in a chunk: 8 µs of springs, and a whole number of vectors of any width, however the
# compiler unrolls its loops.
CHUNK = 2048
# Each counter has a cache line of its own, of so many numbers; the first counts finished chunks.
_LINE = 8
# Reads of a counter before the thread yields its processor.
_SPINS = 2000
# Further reads, some 0.3 µs each, before a thread sleeps.
_YIELDS = 500

_sched_yield = types.ExternalFunction('sched_yield', types.int32())


@inlined
def claim_chunk(counters, thread, threads, chunks, number):  # type: ignore[no-untyped-def]
    """Claim a chunk of loop `number` for this thread; return its index, or -1 if none is left."""
    for other in range(threads):
        owner = (thread + other) % threads
        first = chunks * owner // threads
        count = chunks * (owner + 1) // threads - first
        index = _LINE * (owner + 1)
        ticket = load(counters, index)
        while ticket < (number + 1) * count:
            found = compare_exchange(counters, index, ticket, ticket + 1)
            if found == ticket:
                return first + ticket - number * count
            ticket = found
    return -1


@inlined
def notify(notified, thread):  # type: ignore[no-untyped-def]
    """
    Wake the spinning threads of the pool, from within the kernel of the calling thread.

    They need the GIL to take their task.  Only here has the caller released it; a thread that
    waited for the GIL instead would be woken by the system, which takes longer than a loop.
    """
    if thread == 0:
        fetch_add(notified, 0)


@inlined
def mark_done(counters):  # type: ignore[no-untyped-def]
    """Count a claimed chunk as done."""
    fetch_add(counters, 0)


@exact_subroutine
def barrier(counters, chunks, number):  # type: ignore[no-untyped-def]
    """Wait until all chunks of loop `number` are done."""
    spins = 0
    while load(counters, 0) < (number + 1) * chunks:
        spins += 1
        if spins > _SPINS:
            _sched_yield()


@exact
def _spin(notified, call):  # type: ignore[no-untyped-def]
    """Wait a while for the call after `call`: to be woken by the system takes longer."""
    spins = 0
    while load(notified, 0) == call and spins < _SPINS + _YIELDS:
        spins += 1
        if spins > _SPINS:
            _sched_yield()


_Task = tuple[int, Kernel, Array, Array, int, int, tuple[Any, ...]]

# Queues of all threads besides the callers of pools.
_queues: list[SimpleQueue[_Task]] = []
_growth = threading.Lock()
_pools: WeakSet[ThreadPool] = WeakSet()


def _run_tasks(tasks: SimpleQueue[_Task]) -> None:
    while True:
        call, kernel, notified, counters, thread, threads, arguments = tasks.get()
        kernel(notified, counters, thread, threads, *arguments)
        del kernel, counters, arguments  # arrays of a cloth that may be deleted meanwhile
        # The next task most likely comes from the same pool.
        _spin(notified, call)


def _worker_queues(count: int) -> list[SimpleQueue[_Task]]:
    """Return the queues of so many threads; those that do not run yet are started."""
    with _growth:
        while len(_queues) < count:
            tasks: SimpleQueue[_Task] = SimpleQueue()
            try:
                threading.Thread(target=_run_tasks, args=(tasks,), daemon=True).start()
            except RuntimeError:  # the system has no more threads; fewer give the same result
                break
            _queues.append(tasks)
        return _queues[:count]


class ThreadPool:
    """A number of threads, the calling one included."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._notified = np.zeros(1, np.int64)
        self._calls = itertools.count(1)  # safe to share between threads, as an integer is not
        self._tasks = _worker_queues(threads - 1)
        _pools.add(self)

    def use_calling_thread_only(self) -> None:
        """Run everything in the calling thread from now on."""
        self._tasks = []

    def run(self, kernel: Kernel, *arguments: Any) -> None:
        """Run ``kernel(notified, counters, thread, threads, *arguments)`` in all threads."""
        # New counters in each call: a thread that is late must find those of its own call used up.
        counters = np.zeros(_LINE * (self.threads + 1), np.int64)
        call, notified = next(self._calls), self._notified
        for number, tasks in enumerate(self._tasks, 1):
            tasks.put((call, kernel, notified, counters, number, self.threads, arguments))
        kernel(notified, counters, 0, self.threads, *arguments)


@functools.cache
def shared_thread_pool(threads: int) -> ThreadPool:
    """Return the pool of this size, which all cloths share."""
    return ThreadPool(threads)


def _after_fork() -> None:
    """Continue without workers: threads are not copied into a forked process."""
    _queues.clear()
    shared_thread_pool.cache_clear()
    for pool in _pools:
        pool.use_calling_thread_only()


os.register_at_fork(after_in_child=_after_fork)
