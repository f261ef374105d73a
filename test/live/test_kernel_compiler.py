"""The compiler of kernels, with scripts in place of the child process."""

import json
import os
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from pathlib import Path

import numba
import pytest
from builders import ROOT, scene_of

from bench.layers import folded
from cloth_ros import Cloth, Scene
from cloth_ros.live import kernel_compiler
from cloth_ros.live.compile_kernels import _small, kinds_of, warm_up
from cloth_ros.live.kernel_cache import KernelNotCached, cached_only
from cloth_ros.live.kernel_compiler import KernelCompiler
from cloth_ros.model.precision import precision_for

SCENE = scene_of(sphere__radius=0.1, sphere__position=(0.0, 0.0, 9.0))


class Caching(KernelCompiler):
    """Finds the kernels in the cache as the test has it: False where it must be compiled."""

    def load(self, scene, kinds):
        return self.loads.pop(0)


@pytest.fixture
def here(monkeypatch):
    """Kinds of kernels that were compiled in this process."""
    kinds: list[str] = []
    monkeypatch.setattr(kernel_compiler, 'warm_up', lambda scene, wanted: kinds.extend(wanted))
    return kinds


@pytest.fixture
def make(log, here, monkeypatch, tmp_path):
    """Make a compiler whose child process is a shell script; it is closed after the test."""
    made = []

    def make_compiler(script: str, *loads: bool) -> Caching:
        path = tmp_path / 'child'
        path.write_text(f'#!/bin/sh\n{script}\n')
        path.chmod(0o755)
        monkeypatch.setattr(sys, 'executable', str(path))
        made.append(Caching(log))
        made[-1].loads = list(loads)
        return made[-1]

    yield make_compiler
    for compiler in made:
        compiler.close()


def test_the_child_process_is_given_its_job_and_its_surroundings(
    make, log, here, tmp_path, monkeypatch
):
    monkeypatch.setenv('NUMBA_CACHE_DIR', 'relative')
    script = f'read job; echo "$job" > {tmp_path}/job; pwd > {tmp_path}/place; '
    script += f'echo $NUMBA_CACHE_DIR >> {tmp_path}/place; ps -o sid= -p $$ >> {tmp_path}/place'
    compiler = make(script, False, True)
    assert compiler.compile(SCENE, ('contact',), 'contact (2 of 3)', 7).result(60.0) is None
    job = json.loads((tmp_path / 'job').read_text())
    assert Scene.from_parameters(job['parameters']) == SCENE
    assert (job['kinds'], job['nice']) == (['contact'], 7)
    folder, cache, session = (tmp_path / 'place').read_text().split()
    # The cache belongs to the path of the sources; Ctrl-C is for the parent alone.
    assert (folder, cache) == (str(ROOT), str(Path('relative').absolute()))
    assert int(session) != os.getsid(0)
    assert 'compiling the kernels of contact (2 of 3); they are kept on disk' in log.text
    assert 'compiled the kernels of contact (2 of 3) in' in log.text
    assert not here


@pytest.mark.parametrize(
    ('script', 'loads', 'text'),
    [
        ('exit 0', [True], ''),
        ('exit 0', [False, False, True], 'compiled the kernels'),  # missed by the first
        ('exit 0', [False, False, False], 'in this process'),
        ('echo broken >&2; exit 3', [False, False], 'ended with 3 after'),
        ('echo broken >&2; exit 3', [False, True], 'broken'),
        ('echo a full disk >&2', [False, False], 'a full disk'),
        ('exec sleep 0.2', [False, True], 'sleep: 0 s so far'),
    ],
)
def test_what_the_child_process_does_not_compile_is_compiled_here(
    make, log, here, script, loads, text, monkeypatch
):
    if 'sleep' in script:
        monkeypatch.setattr(kernel_compiler, '_PROGRESS', 0.01)
    compiler = make(script, *loads)
    compiler.ensure(SCENE, ('motion',), 'sleep')
    assert compiler.loads == []
    assert here == ([] if loads[-1] else ['motion'])
    assert text in log.text
    assert bool(log.text) == (not loads[0])


def test_without_a_process_or_a_cache_kernels_are_compiled_here(make, log, here, monkeypatch):
    compiler = make('exit 0', False, False, False, False)
    monkeypatch.setattr(sys, 'executable', '/nowhere')
    compiler.ensure(SCENE, ('motion',), 'motion')
    assert 'no process to compile the kernels of motion: ' in log.text
    monkeypatch.setattr(kernel_compiler, 'cache_exists', lambda: False)
    compiler.ensure(SCENE, ('contact',), 'contact')
    assert log.text.endswith('compiling the kernels of contact in this process\n')
    assert here == ['motion', 'contact']


def test_different_kinds_are_compiled_at_once_and_closing_kills_all_processes(make, log):
    compiler = make('exec sleep 1000', *[False] * 4)
    futures = [compiler.compile(SCENE, (kind,), kind) for kind in ('motion', 'contact', 'motion')]
    end = time.monotonic() + 60.0
    while log.text.count('compiling the kernels') < 2:
        assert time.monotonic() < end
        time.sleep(0.01)
    children = list(compiler._children)
    assert len(children) == 2  # one of each kind
    compiler.close()
    for future in futures:
        with pytest.raises(CancelledError):
            future.result(60.0)
    assert all(child.wait(60.0) != 0 for child in children)
    assert 'in this process' not in log.text
    with pytest.raises(RuntimeError):
        compiler.compile(SCENE, ('motion',), 'motion')


@pytest.mark.slow
def test_the_child_process_compiles_what_the_scene_needs():
    """Here it finds the kernels in the cache, if they were needed before."""
    job = {'parameters': SCENE.flat(), 'kinds': list(kinds_of(SCENE)), 'nice': 1}
    command = [sys.executable, '-m', 'cloth_ros.live.compile_kernels']
    child = subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    child.stdin.write(json.dumps(job) + '\n')
    child.stdin.flush()
    assert child.wait(240.0) == 0, child.stderr.read()
    child.communicate()
    with cached_only():  # loaded from the cache of the child process
        KernelCompiler(None).load(SCENE, kinds_of(SCENE))


SOFT = {f'springs__{kind}': 0.01 for kind in ('structural', 'shear', 'bending')}


@pytest.mark.parametrize(
    ('parameters', 'expected'),
    [
        ({}, 'single'),
        # Substeps of a large, soft sheet are longer than those of a small one.
        ({'sheet__rows': 200, 'sheet__columns': 200, 'gravity': (0, 0, -0.01), **SOFT}, 'single'),
        ({'solver__precision': 'double'}, 'double'),
        ({'drag': 1e-3}, 'double'),
        ({'sheet__mass': 1e-3, 'springs__damping': 200.0}, 'double'),
        ({'springs__structural': 1e8, 'sheet__mass': 1e-6, 'sheet__size': (1e3, 1e3)}, 'double'),
    ],
)
def test_kernels_are_compiled_in_the_precision_of_the_scene(parameters, expected):
    scene = scene_of(**parameters)
    assert (precision_for(scene), precision_for(_small(scene))) == (expected, expected)


def test_kinds_of_kernels():
    assert kinds_of(SCENE) == ('motion', 'contact')
    assert kinds_of(scene_of()) == ('motion',)


def test_nothing_is_compiled_where_that_is_forbidden():
    double = numba.njit(lambda x: 2 * x)
    with pytest.raises(KernelNotCached), cached_only():
        double(1.0)
    assert double(1.0) == 2.0
    with cached_only():
        assert double(2.0) == 4.0


def test_no_kernel_is_compiled_while_layers_fall_on_a_collider():
    """Not even those of contact of the sheet with itself where a collider supports it."""
    table = {'names': ['table'], 'table': {'type': 'plane'}}
    sheet = {'sheet__rows': 9, 'sheet__columns': 17, 'sheet__size': (0.6, 0.3)}
    limp = {f'springs__{kind}': 0.1 for kind in ('structural', 'shear', 'bending')}
    scene = scene_of(pins=[''], collider=table, self_contact__thickness=4e-3, **sheet, **limp)
    warm_up(scene, kinds_of(scene))
    cloth, layers, touching = Cloth(scene), 0, 0
    positions = folded(9, 17, (0.6, 0.3), 6e-3)
    positions[..., 2] += 0.005
    cloth.positions = positions
    with cached_only():
        for _ in range(15):
            cloth.advance(1 / 60)
            layers = max(layers, cloth.self_contact.contacts)
            touching = max(touching, cloth.colliders['table'].touching)
    assert layers > 0
    assert touching > 0
