"""Threads: the same bits for any number, shared workers, forks, and systems without threads."""

import gc
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor
from time import monotonic, sleep

import numpy as np
import pytest
from builders import cloth_of, run_python

from cloth_ros import Cloth
from cloth_ros.model.integrators import kick_drift
from cloth_ros.model.kernels import thread_pool


def advanced(threads: int, precision: str = 'single') -> Cloth:
    """Return a cloth with all forces after some substeps."""
    sheet = {'rows': 70, 'columns': 75}
    forces = {'springs__damping': 1e-4, 'wind__velocity': [1.0, 3.0, 2.0]}
    cloth = cloth_of(sheet=sheet, **forces, solver={'threads': threads, 'precision': precision})
    cloth.advance(0.03)
    return cloth


def same(cloth: Cloth, other: Cloth) -> bool:
    return np.array_equal([cloth.positions, cloth.velocities], [other.positions, other.velocities])


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_results_are_the_same_bits_for_any_number_of_threads(precision):
    alone = advanced(1, precision)
    assert all(same(advanced(threads, precision), alone) for threads in (2, 3))


def test_pools_of_all_sizes_share_their_threads():
    alone, before = advanced(1), threading.active_count()
    # Several pools at once, as a cloth and its finer solution use them.
    with ThreadPoolExecutor(2) as callers:
        for size in (5, 2, 6, 3):
            assert all(same(each, alone) for each in callers.map(advanced, (size, size - 1)))
    assert threading.active_count() <= before + 5


def test_workers_hold_no_reference_to_a_deleted_cloth():
    array = weakref.ref(advanced(2)._simulation._kick_drift.work)
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
    assert same(advanced(3), alone)


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
    other = Cloth(scene)
    for each in (cloth, other, other):
        each.advance(0.01)
    same = (other.positions == cloth.positions).all()
    os._exit(not same or any(not tasks.empty() for tasks in former))
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_a_forked_process_gives_no_work_to_threads_that_it_does_not_have():
    found = run_python(FORK)
    assert found.stdout == '0\n', found.stdout + found.stderr
