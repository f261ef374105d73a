"""Kernels that were never compiled on the machine."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from reliability.live import NODE
from ros_messages import diagnosis, numbers, regular, set_parameters, stamp
from sensor_msgs.msg import PointCloud2


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))


def children(pid: int) -> list[int]:
    """Return the processes that a process has started, and that have not ended."""
    found = subprocess.run(
        ['ps', '-o', 'pid=', '--ppid', str(pid)], capture_output=True, text=True
    )
    return [int(text) for text in found.stdout.split()]


def test_the_cloth_is_published_at_once_and_moves_when_its_kernels_are_there(start, probe):
    node = start(*NODE, '--ros-args', '--params-file', 'config/gust.yaml')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: particles)
    first = numbers(particles[0])
    assert 'compiling the kernels of motion (1 of 3)' in node.output
    assert 'the cloth is held: the kernels of motion' in diagnosis(probe)['message']
    # The sphere is beside the curtain: kernels of contact are not waited for.
    probe.spin_until(lambda: (numbers(particles[-1]) != first).any())
    node.wait_for_output('publishing')
    assert 'a collider may touch it' not in node.output
    probe.spin_until(lambda: 'compiled the kernels of the error estimate (3 of 3)' in node.output)
    probe.spin_until(lambda: diagnosis(probe)['message'] == 'running in real time')


def test_a_sphere_that_touches_the_sheet_at_the_start_is_waited_for(start, probe):
    """There is no initial state without kernels of contact: the sphere shrinks to its room."""
    sphere = ('-p', 'sphere.radius:=0.3', '-p', 'sphere.position:=[0.0, 0.0, 1.0]')
    node = start(*NODE, '--ros-args', *sphere)
    node.wait_for_output('compiling the kernels of contact')
    node.wait_for_output('publishing')
    assert 0 < float(diagnosis(probe)['sphere radius [m]']) <= 0.3


def test_the_cloth_continues_while_kernels_of_a_change_are_compiled(start_cloth, probe):
    node = start_cloth(wind__air_density=0.0)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: particles)
    results = set_parameters(probe, springs__damping=1e-3, rate=120.0)
    assert all(result.successful for result in results)
    node.wait_for_output('compiling kernels for the changed parameters')
    particles.clear()
    # The summary is logged at the start, and when the change takes effect.
    probe.spin_until(lambda: node.output.count('stability limit') == 2)
    assert len(particles) > 20
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 120))


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_processes_that_compile_end_with_the_node(start, number):
    node = start(*NODE, '--ros-args', '--params-file', 'config/gust.yaml')
    node.wait_for_output('compiling the kernels of contact')
    compiling = children(node.process.pid)
    assert len(compiling) == 2
    assert node.stop(number) == (-number if number == signal.SIGKILL else 0)
    end = time.monotonic() + 5.0
    while any(Path(f'/proc/{pid}').exists() for pid in compiling):
        assert time.monotonic() < end
        time.sleep(0.01)


def test_the_child_process_ends_with_its_input(tmp_path):
    child = subprocess.Popen(
        [sys.executable, '-m', 'cloth_ros.live.compile_kernels'],
        stdin=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    child.communicate(b'', timeout=30.0)
    assert child.returncode != 0
