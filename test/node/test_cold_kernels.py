"""Kernels that are not in the cache on disk, at the start and after a change."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from ros import NODE, diagnosis, numbers, regular, set_parameters, stamp
from sensor_msgs.msg import PointCloud2

GUST = (*NODE, '--ros-args', '--params-file', 'config/gust.yaml')


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))


@pytest.mark.slow
def test_the_cloth_is_published_at_once_and_moves_when_its_kernels_are_compiled(start, probe):
    node = start(*GUST)
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
    probe.spin_until(lambda: 'kernels' not in diagnosis(probe)['message'])


@pytest.mark.slow
def test_kernels_of_contact_are_waited_for_where_the_sphere_touches_the_sheet(start, probe):
    """There is no initial state without them: the sphere shrinks to the room that it has."""
    sphere = ('-p', 'sphere.radius:=0.3', '-p', 'sphere.position:=[0.0, 0.0, 1.0]')
    node = start(*NODE, '--ros-args', *sphere)
    node.wait_for_output('compiling the kernels of contact')
    node.wait_for_output('publishing')
    assert 0 < float(diagnosis(probe)['sphere radius [m]']) <= 0.3


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_processes_that_compile_end_with_the_node(start, probe, number):
    node = start(*GUST)
    node.wait_for_output('compiling the kernels of contact')
    command = ['ps', '-o', 'pid=', '--ppid', str(node.process.pid)]
    compiling = subprocess.run(command, capture_output=True, text=True).stdout.split()
    assert len(compiling) == 2
    assert node.stop(number) == (-number if number == signal.SIGKILL else 0)
    probe.spin_until(lambda: not any(Path(f'/proc/{pid}').exists() for pid in compiling))


def test_a_process_that_compiles_ends_with_its_input():
    command = [sys.executable, '-m', 'cloth_ros.live.compile_kernels']
    assert subprocess.run(command, input=b'', capture_output=True).returncode != 0
