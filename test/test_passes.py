"""The compiled kernel: how it is composed, vectorised, and shared by threads."""

import gc
import os
import re
import subprocess
import sys
import threading
import time
import weakref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ros import ROOT

from cloth_ros import Cloth, Scene
from cloth_ros.live.kernel_compiler import Background
from cloth_ros.model.integrators import kick_drift
from cloth_ros.model.integrators.integrator import SubstepBatch, plan
from cloth_ros.model.kernels import thread_pool
from cloth_ros.model.time_step import dissipation_interval

EVERYTHING = {
    'sheet.rows': 70,
    'sheet.columns': 75,
    'springs.damping': 1e-4,
    'wind.velocity': [1.0, 3.0, 2.0],
}

ASSEMBLY = """
import sys
from cloth_ros import Cloth, Scene
scene = Scene().with_parameters({'springs.damping': 1e-3, 'solver.precision': sys.argv[1]})
cloth = Cloth(scene)
cloth.advance(0.01)
(assembly,) = cloth._dynamics._kernel.inspect_asm().values()
print(assembly)
"""


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_the_loops_are_vectorised(precision, tmp_path):
    """Every reciprocal root of a spring is one of several particles at once."""
    done = subprocess.run(
        [sys.executable, '-c', ASSEMBLY, precision],
        env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    packed = re.findall(r'\bv?rsqrt(?:14)?ps\b.*', done.stdout)
    # Three loops over springs, twelve springs each; what remains at their ends is scalar.
    assert len(packed) >= 3 * 12
    if 'vrsqrt14ps' in done.stdout:  # a processor with AVX-512
        wide = 'zmm' if precision == 'single' else 'ymm'  # eight doubles make eight singles
        assert sum(wide in line for line in packed) >= 3 * 12


def run(**changes: object) -> tuple[np.ndarray, np.ndarray]:
    cloth = Cloth(Scene().with_parameters({**EVERYTHING, **changes}))
    for _ in range(3):
        cloth.advance(1 / 60)
    return cloth.positions, cloth.velocities


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_the_result_has_the_same_bits_with_any_number_of_threads(precision):
    alone = run(**{'solver.precision': precision})
    for threads in (2, 3):
        shared = run(**{'solver.precision': precision, 'solver.threads': threads})
        for one, other in zip(alone, shared, strict=True):
            assert np.array_equal(one, other)


def test_teams_of_all_sizes_share_their_threads():
    before = threading.active_count()
    alone = run()
    # Going up and down, and several at once, as a cloth and its twin do.
    for size in (5, 2, 6, 3, 4, 6):
        shared = [
            Background(lambda size=size - k: run(**{'solver.threads': size})) for k in (0, 1)
        ]
        for each in shared:
            assert each.wait(60.0)
            assert each.error is None
            for one, other in zip(alone, each.made, strict=True):
                assert np.array_equal(one, other)
    assert threading.active_count() <= before + 5


@given(substeps=st.integers(1, 60), spacing=st.integers(0, 20).map(lambda n: 2 * n + 1))
def test_dissipation_acts_for_every_substep_and_in_their_middle(substeps, spacing):
    done, covered = 0, 0
    for plain, weight in plan(substeps, spacing):
        done += plain + (weight > 0)
        assert weight <= spacing
        if weight:
            assert weight % 2 == 1
            assert done - 1 == covered + weight // 2
            covered += weight
    assert done == covered == substeps


def test_dissipation_in_one_of_several_substeps_is_of_second_order():
    """Against dissipation in every one, with a tenth of the step."""

    def carry(substeps: int, spacing: int) -> np.ndarray:
        soft = {f'springs.{kind}': 2.0 for kind in ('structural', 'shear', 'bending')}
        cloth = Cloth(
            Scene().with_parameters(
                {**EVERYTHING, **soft, 'sheet.rows': 8, 'sheet.columns': 9, 'drag': 2.0}
                | {'springs.damping': 0.01, 'solver.precision': 'double'}
            )
        )
        x, y, z = np.moveaxis(cloth.positions, -1, 0)
        cloth.positions = np.stack([x, y, z + 0.1 * np.cos(2 * x) * np.cos(3 * y)], -1)
        cloth._air[:] = cloth.wind
        blocks = [SubstepBatch(9, 0.18 / substeps, spacing)] * (substeps // 9)
        for _ in cloth._method.run(cloth._state, blocks, cloth._moved, cloth._watched):
            pass
        return cloth.positions

    exact = carry(9 * 400, 1)
    errors = [np.abs(carry(9 * n, 9) - exact).max() for n in (10, 20, 40)]
    np.testing.assert_allclose(-np.diff(np.log2(errors)), 2, atol=0.1)


@given(
    substep=st.floats(1e-6, 0.1),
    viscous=st.floats(0, 1e6),
    airspeed=st.one_of(st.floats(0, 1e5), st.just(float('inf'))),
)
def test_dissipation_is_spaced_by_an_odd_number_and_takes_little_at_once(
    substep, viscous, airspeed
):
    scene = Scene()
    spacing = dissipation_interval(scene, substep, viscous, airspeed)
    assert spacing % 2 == 1
    assert 1 <= spacing <= 17
    if spacing > 1:
        assert spacing * substep * viscous <= 0.5
        assert spacing * substep <= 3e-3


FORKED = """
import os
from cloth_ros import Cloth, Scene
from cloth_ros.model.kernels import thread_pool
scene = Scene(sheet={'rows': 96, 'columns': 96}, solver={'threads': 2})
cloth = Cloth(scene)
cloth.advance(0.01)
child = os.fork()
if child == 0:
    waiting = [tasks for each in team._teams for tasks in each._tasks]
    cloth.advance(0.01)
    other = Cloth(scene)
    other.advance(0.01)
    other.advance(0.01)
    same = (other.positions == cloth.positions).all()
    # Nothing was given to threads that are not there.
    os._exit(not same or any(not tasks.empty() for tasks in waiting))
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_a_forked_process_starts_threads_of_its_own():
    found = subprocess.run(
        [sys.executable, '-c', FORKED], capture_output=True, text=True, timeout=120, cwd=ROOT
    )
    assert found.stdout == '0\n', found.stdout + found.stderr


def test_threads_keep_nothing_of_a_cloth_that_has_ended():
    cloth = Cloth(Scene(sheet={'rows': 96, 'columns': 96}, solver={'threads': 2}))
    cloth.advance(0.02)
    positions = weakref.ref(cloth._kick_drift._work)
    del cloth
    end = time.monotonic() + 10.0
    while positions() is not None and time.monotonic() < end:
        gc.collect()
        time.sleep(0.01)
    assert positions() is None


def test_where_no_thread_can_be_had_the_others_do_the_work(monkeypatch):
    def start(_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, 'start', start)
    monkeypatch.setattr(thread_pool, '_queues', [])
    alone = thread_pool.ThreadPool(3)
    monkeypatch.setattr(kick_drift, 'shared_thread_pool', lambda _: alone)
    scene = Scene(sheet={'rows': 96, 'columns': 96})
    cloth, other = Cloth(scene), Cloth(scene.with_parameters({'solver.threads': 3}))
    for each in (cloth, other):
        each.advance(0.02)
    assert np.array_equal(cloth.positions, other.positions)
