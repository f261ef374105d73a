"""The node as a process: signals, overload, namespaces, errors at the start, examples."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import Vector3Stamped
from ros import (
    FLOATING,
    SPHERE,
    diagnosis,
    numbers,
    set_parameters,
    wind,
)
from sensor_msgs.msg import PointCloud2

# s; half a second on an idle machine, and much less than a tick of the largest sheet takes.
SOON = 30.0


def test_overload_is_reported_as_slow_motion_with_its_cause(start_cloth, probe):
    """With springs so stiff that no machine keeps up."""
    node = start_cloth(sheet__rows=128, sheet__columns=128, springs__structural=1e8)
    cause = 'because springs.structural is 1e+08 N/m at a mass of 0.2 kg on 128 × 128 particles'
    assert 'too slow for real time: ' in node.output
    assert cause in node.output
    particles = probe.collect(PointCloud2, '/cloth/particles')
    found = {}

    def slow():
        found.update(diagnosis(probe))
        return 'slow motion' in found['message'] and particles

    probe.spin_until(slow)
    assert found['level'] == b'\x01'
    assert float(found['real-time factor']) < 0.9
    assert cause in found['message']
    assert 'makes it real time: springs.structural: ' in found['message']


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_without_a_traceback(start_cloth, probe, number):
    node = start_cloth()
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(particles) > 5)
    began = time.monotonic()
    assert node.stop(number) == 0
    assert time.monotonic() - began < SOON
    assert 'Traceback' not in node.output


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_where_no_clock_ticks(start_cloth, number):
    node = start_cloth(use_sim_time='true')
    began = time.monotonic()
    assert node.stop(number) == 0
    assert time.monotonic() - began < SOON


def test_a_signal_ends_it_in_the_middle_of_a_long_tick(start_cloth, probe):
    node = start_cloth(sheet__rows=1000, sheet__columns=1000, solver__tolerance=1e-6)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: particles)
    began = time.monotonic()
    assert node.stop(signal.SIGTERM) == 0
    assert time.monotonic() - began < SOON
    assert 'Traceback' not in node.output
    assert 'FATAL' not in node.output


def test_a_file_that_cannot_be_read_is_refused_in_one_line(start, tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text('[')
    node = start(
        sys.executable, '-m', 'cloth_ros.node.main', '--ros-args', '--params-file', str(path)
    )
    assert node.stop(0, patience=30.0) == 2
    assert 'Traceback' not in node.output
    assert 'scene.yaml' in node.output


def test_nodes_run_side_by_side_in_namespaces(start_cloth, probe):
    for name in ('left', 'right'):
        start_cloth('-r', f'__ns:=/{name}', **FLOATING)
    left = probe.collect(PointCloud2, '/left/cloth/particles')
    right = probe.collect(PointCloud2, '/right/cloth/particles')
    probe.publisher(Vector3Stamped, '/left/wind').publish(wind(z=5.0))
    probe.spin_until(lambda: left and right and numbers(left[-1])[..., 5].any())
    assert not numbers(right[-1])[..., 5].any()


def test_it_starts_without_a_home(start):
    bare = dict.fromkeys(('ROS_LOG_DIR', 'ROS_HOME'), '')
    node = start(
        'env',
        '-u',
        'HOME',
        '-u',
        'ROS_LOG_DIR',
        sys.executable,
        '-m',
        'cloth_ros.node.main',
        **bare,
    )
    node.wait_for_output('publishing')
    node.wait_for_output('no log file')


def test_the_example_commands_it(start_cloth, start, probe):
    start_cloth(**FLOATING, **SPHERE)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    example = start(sys.executable, 'examples/command.py', '--wind', '0', '-1e-1', '3')
    assert example.stop(0, patience=30.0) == 0, example.output
    probe.spin_until(lambda: particles and numbers(particles[-1])[..., 5].any())
    example = start(
        sys.executable,
        'examples/command.py',
        '--from',
        '0',
        '0',
        '2',
        '--sphere',
        '0',
        '0',
        '0.5',
        '--over',
        '0.2',
        '--pause',
        '--reset',
    )
    assert example.stop(0, patience=30.0) == 0, example.output
    assert 'paused' in example.output
    assert 'initial state' in example.output


def test_the_example_watches_it(start_cloth, start):
    start_cloth()
    watch = start(sys.executable, '-u', 'examples/watch.py')
    watch.wait_for_output(' Hz ')
    assert watch.stop(patience=5.0) == 0, watch.output
    assert 'Traceback' not in watch.output


def test_usage_names_the_commands_or_the_error(start, tmp_path):
    command = (sys.executable, '-m', 'tools.usage', 'python')
    usage = start(*command, 'config/gust.yaml')
    assert usage.stop(0, patience=30.0) == 0
    assert '--from 0 -0.6 1.4 --sphere 0 0 1.5' in usage.output
    assert '--sphere' not in start(*command, 'config/hanging.yaml').output
    path = tmp_path / 'bad.yaml'
    path.write_text('/**: {ros__parameters: {sheet: {rows: -3}}}')
    rejection = start(*command, str(path))
    assert rejection.stop(0, patience=30.0) == 1
    assert 'sheet.rows is -3' in rejection.output
    assert len(rejection.output.splitlines()) == 1


def test_no_process_is_left_behind():
    """The fixtures end the processes that they start."""
    children = Path(f'/proc/self/task/{os.getpid()}/children').read_text().split()
    names = [Path(f'/proc/{child}/cmdline').read_text() for child in children]
    assert not [name for name in names if 'cloth_node' in name]


def test_an_overload_coarsens_the_grid_and_keeps_time(start_cloth, probe):
    """With springs so stiff that no machine keeps up; with softer ones the grid is restored."""
    stiff = {'springs__structural': 1e7, 'springs__shear': 1e7}
    node = start_cloth(solver__overload='coarsen', sheet__rows=64, sheet__columns=64, **stiff)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    node.wait_for_output('times coarser')
    probe.spin_until(lambda: 'coarser' in diagnosis(probe)['message'])
    particles.clear()
    probe.spin_until(lambda: len(particles) > 5)
    assert (particles[-1].height, particles[-1].width) == (64, 64)
    assert np.isfinite(numbers(particles[-1])).all()
    results = set_parameters(probe, springs__structural=500.0, springs__shear=250.0)
    assert all(result.successful for result in results)
    probe.spin_until(lambda: 'real time' in diagnosis(probe)['message'])
