"""Threads: the same bits for any number, shared workers, forks, and systems without threads."""

import gc
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor
from time import monotonic, sleep

import numpy as np
import pytest
from builders import cloth_of, run_python

from cloth_ros.model.integrators import kick_drift
from cloth_ros.model.kernels import thread_pool


def advanced(threads: int, precision: str = 'single') -> np.ndarray:
    """Return positions and velocities of a sheet with all forces after some substeps."""
    cloth = cloth_of(
        sheet__rows=70,
        sheet__columns=75,
        springs__damping=1e-4,
        wind__velocity=[1.0, 3.0, 2.0],
        solver__precision=precision,
        solver__threads=threads,
    )
    cloth.advance(0.03)
    return np.stack([cloth.positions, cloth.velocities])


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_results_are_the_same_bits_for_any_number_of_threads(precision):
    alone = advanced(1, precision)
    for threads in (2, 3):
        assert np.array_equal(advanced(threads, precision), alone)


def test_pools_of_all_sizes_share_their_threads():
    alone, before = advanced(1), threading.active_count()
    # Several pools at once, as a cloth and its finer solution use them.
    with ThreadPoolExecutor(2) as callers:
        for size in (5, 2, 6, 3):
            for shared in callers.map(advanced, (size, size - 1)):
                assert np.array_equal(shared, alone)
    assert threading.active_count() <= before + 5


def test_workers_hold_no_reference_to_a_deleted_cloth():
    cloth = cloth_of(sheet__rows=70, sheet__columns=70, solver__threads=2)
    cloth.advance(0.01)
    array = weakref.ref(cloth._simulation._kick_drift._work)
    del cloth
    end = monotonic() + 60.0
    while array() is not None and monotonic() < end:
        gc.collect()
        sleep(0.01)
    assert array() is None


def test_the_calling_thread_does_all_work_where_no_other_can_be_started(monkeypatch):
    def start(_):
        raise RuntimeError("can't start new thread")

    alone = advanced(1)
    monkeypatch.setattr(threading.Thread, 'start', start)
    monkeypatch.setattr(thread_pool, '_queues', [])
    pool = thread_pool.ThreadPool(3)
    monkeypatch.setattr(kick_drift, 'shared_thread_pool', lambda _: pool)
    assert np.array_equal(advanced(3), alone)


FORK = """
import os
from cloth_ros import Cloth, Scene
from cloth_ros.model.kernels import thread_pool
scene = Scene(sheet={'rows': 70, 'columns': 70}, solver={'threads': 2})
cloth = Cloth(scene)
cloth.advance(0.01)
child = os.fork()
if child == 0:
    former = [tasks for pool in thread_pool._pools for tasks in pool._tasks]
    cloth.advance(0.01)
    other = Cloth(scene)
    other.advance(0.01)
    other.advance(0.01)
    same = (other.positions == cloth.positions).all()
    os._exit(not same or any(not tasks.empty() for tasks in former))
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_a_forked_process_gives_no_work_to_threads_that_it_does_not_have():
    found = run_python(FORK)
    assert found.stdout == '0\n', found.stdout + found.stderr
