"""The node as a process of its own, on real DDS."""

import itertools
import math
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from ros import (
    FLOATING,
    SPHERE,
    diagnosis,
    numbers,
    pose,
    regular,
    set_parameters,
    stamp,
    wind,
)
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

# s; it is half a second on an idle machine, and this one may be anything but.
SOON = 3.0


def test_rates_stamps_frames_and_layout(start_cloth, probe):
    start_cloth('--params-file', 'config/gust.yaml')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 60))
    assert -0.05 < time.time() - stamp(particles[-1]) < 10  # this clock, however busy we are
    assert np.diff([stamp(message) for message in particles]).min() > 0
    cloud = particles[-1]
    assert (cloud.height, cloud.width, cloud.point_step) == (36, 36, 24)
    assert cloud.header.frame_id == 'world'
    # Velocities are those of the positions, and stamps those of the states.
    first, last = min(
        itertools.pairwise(particles[-30:]), key=lambda pair: stamp(pair[1]) - stamp(pair[0])
    )
    moved = numbers(last)[..., :3] - numbers(first)[..., :3]
    mean = (numbers(last)[..., 3:] + numbers(first)[..., 3:]) / 2
    np.testing.assert_allclose(moved, mean * (stamp(last) - stamp(first)), atol=2e-3)

    markers = probe.collect(MarkerArray, '/cloth/markers')
    probe.spin_until(lambda: regular([stamp(m.markers[0]) for m in markers], 1 / 30))
    assert {marker.ns for marker in markers[0].markers} == {'sheet', 'pins', 'sphere', 'wind'}


def test_wind_from_another_process_is_felt_within_two_ticks(start_cloth, probe):
    start_cloth(**FLOATING)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    blow = probe.publisher(Vector3Stamped, '/wind')
    probe.spin_until(lambda: len(particles) > 5)
    assert not numbers(particles[-1])[..., 5].any()
    sent = time.time()
    blow.publish(wind(z=5.0))
    probe.spin_until(lambda: particles and numbers(particles[-1])[..., 5].any())
    still = [
        message
        for message in particles
        if stamp(message) > sent and not numbers(message)[..., 5].any()
    ]
    assert len(still) <= 2
    assert numbers(particles[-1])[..., 5].max() > 0


def test_the_sphere_moved_by_topic_pushes_the_cloth(start_cloth, probe):
    start_cloth(**FLOATING, **SPHERE, wind__air_density=0.0)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    move = probe.publisher(PoseStamped, '/sphere_pose')
    probe.spin_until(lambda: particles)
    assert np.allclose(numbers(particles[-1])[..., 2], 1.0)
    move.publish(pose(z=0.7, frame='world'))

    def pushed():
        heights = (numbers(message)[4, 4, 2] for message in particles)
        return [height for height in heights if height <= 0.601]

    probe.spin_until(pushed)
    assert pushed()[0] == pytest.approx(0.6, abs=0.05)


def test_pause_and_reset(start_cloth, probe):
    start_cloth(rate=60)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(particles) > 20)
    assert probe.call(SetBool, '/cloth/pause', SetBool.Request(data=True)).success
    particles.clear()
    probe.spin_until(lambda: len(particles) >= 10)
    assert len({bytes(message.data) for message in particles}) == 1
    assert len({stamp(message) for message in particles}) == 1  # it is the state of that time
    assert probe.call(Trigger, '/cloth/reset', Trigger.Request()).success
    particles.clear()
    probe.spin_until(lambda: len(particles) >= 3)
    initial = numbers(particles[-1])
    assert np.array_equal(np.unique(initial[..., 2]), [1.0])
    assert not initial[..., 3:].any()
    assert diagnosis(probe)['message'] == 'paused'
    assert probe.call(SetBool, '/cloth/pause', SetBool.Request(data=False)).success
    particles.clear()
    probe.spin_until(lambda: particles and numbers(particles[-1])[..., 2].min() < 0.9)


def test_inputs_that_cannot_be_are_refused_and_counted(start_cloth, probe):
    node = start_cloth(**FLOATING, **SPHERE)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    blow = probe.publisher(Vector3Stamped, '/wind')
    move = probe.publisher(PoseStamped, '/sphere_pose')
    for bad in (math.nan, math.inf, 1e308, -1e5):
        blow.publish(wind(x=bad))
        move.publish(pose(y=bad * 1e3))
    blow.publish(wind(x=1.0, frame='moon'))
    move.publish(pose(z=1.0, frame='moon'))
    found = {}

    def counted():
        found.update(diagnosis(probe))
        return found['rejected wind'] == '5' and found['rejected sphere_pose'] == '5'

    probe.spin_until(counted)
    assert found['rejected inputs'] == '10'
    assert not numbers(particles[-1])[..., 5].any()
    # Throttled: one line for each input, not one for each message.
    assert node.output.count('rejected a message on wind') == 1
    assert node.output.count('rejected a message on sphere_pose') == 1
    blow.publish(wind(z=5.0))  # and it goes on
    probe.spin_until(lambda: numbers(particles[-1])[..., 5].any())


def test_wind_without_air_and_sphere_without_radius_say_what_to_set(start_cloth, probe):
    node = start_cloth(**FLOATING, wind__air_density=0.0)
    probe.publisher(Vector3Stamped, '/wind').publish(wind(z=5.0))
    probe.publisher(PoseStamped, '/sphere_pose').publish(pose(z=1.0))
    node.wait_for_output('wind.air_density')
    node.wait_for_output('sphere.radius')


def test_diagnostics_tell_how_it_runs(start_cloth, probe):
    start_cloth()
    messages = probe.collect(DiagnosticArray, '/diagnostics')
    probe.spin_until(lambda: len(messages) >= 3)
    assert stamp(messages[2]) - stamp(messages[1]) == pytest.approx(1.0, abs=0.5)
    found = diagnosis(probe)
    assert found['name'] == '/cloth: simulation'
    assert float(found['real-time factor']) == pytest.approx(1.0, abs=0.5)
    assert 0 < float(found['step [s]']) < float(found['stability limit [s]'])
    assert int(found['substeps in the last tick']) > 10
    for key in ('energy [J]', 'largest strain', 'error estimate [m]'):
        assert math.isfinite(float(found[key]))
    assert found['rejected inputs'] == '0'


def test_overload_is_slow_motion_and_says_so(start_cloth, probe):
    start_cloth(sheet__rows=128, sheet__columns=128, solver__tolerance=1e-5)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    found = {}

    def slow():
        found.update(diagnosis(probe))
        return 'slow motion' in found['message']

    probe.spin_until(slow)
    assert found['level'] == b'\x01'
    assert float(found['real-time factor']) < 0.9
    assert particles
    (result,) = set_parameters(
        probe,
        solver__tolerance=1.0,
        springs__structural=1.0,
        springs__shear=0.0,
        springs__bending=0.0,
    )[:1]
    assert result.successful
    probe.spin_until(lambda: diagnosis(probe)['message'] == 'running in real time')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_within_a_second_without_a_traceback(start_cloth, probe, number):
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


def test_simulated_time_is_followed(start_cloth, probe):
    start_cloth(use_sim_time='true', rate=50)
    clock = probe.create_publisher(Clock, '/clock', 10)
    probe.spin_until(clock.get_subscription_count)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_for(0.3)
    assert not particles  # no clock, no ticks
    assert 'clock' in diagnosis(probe)['message']
    message = Clock()
    for n in range(100):
        message.clock.sec, message.clock.nanosec = divmod(10**9 * 1000 + n * 20_000_000, 10**9)
        clock.publish(message)
        probe.spin_for(0.002)
    probe.spin_until(lambda: particles and stamp(particles[-1]) > 1001.9)
    stamps = np.array([stamp(message) for message in particles])
    assert np.all((stamps >= 999.9) & (stamps <= 1002))
    # Two seconds of a fall that real time had no half second for; a few ticks may be dropped.
    assert numbers(particles[-1])[..., 2].min() < 0.4


def test_a_clock_that_jumps_loses_no_time_and_no_markers(start_cloth, probe):
    node = start_cloth(use_sim_time='true', rate=50)
    clock = probe.create_publisher(Clock, '/clock', 10)
    probe.spin_until(clock.get_subscription_count)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    markers = probe.collect(MarkerArray, '/cloth/markers')
    for start_at in (1_700_000_000, 1_800_000_000, 100):
        for n in range(60):
            message = Clock()
            nanoseconds = 10**9 * start_at + n * 20_000_000
            message.clock.sec, message.clock.nanosec = divmod(nanoseconds, 10**9)
            clock.publish(message)
            probe.spin_for(0.004)
        probe.spin_until(lambda: abs(stamp(particles[-1]) - start_at) < 5)  # noqa: B023
        probe.spin_until(lambda: abs(stamp(markers[-1].markers[0]) - start_at) < 5)  # noqa: B023
    assert 'slow motion' not in node.output


def test_markers_that_the_scene_loses_are_taken_away(start_cloth, probe):
    start_cloth(**FLOATING, **SPHERE)
    markers = probe.collect(MarkerArray, '/cloth/markers')
    probe.spin_until(lambda: markers)
    set_parameters(probe, sphere__radius=0.0, wind__air_density=0.0, pins=[''])

    def deleted():
        return {
            marker.ns
            for message in markers
            for marker in message.markers
            if all(each.action == Marker.DELETE for each in message.markers)
        }

    probe.spin_until(lambda: deleted() == {'sphere', 'wind', 'pins'})  # at once or one by one
    markers.clear()
    probe.spin_until(lambda: len(markers) > 3)
    assert {marker.ns for marker in markers[-1].markers} == {'sheet'}


def test_a_signal_ends_it_in_the_middle_of_a_long_tick(start_cloth, probe):
    node = start_cloth(sheet__rows=1000, sheet__columns=1000, solver__tolerance=1e-6)
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: particles)
    began = time.monotonic()
    assert node.stop(signal.SIGTERM) == 0
    assert time.monotonic() - began < SOON
    assert 'Traceback' not in node.output
    assert 'FATAL' not in node.output


def test_a_signal_ends_it_while_kernels_are_prepared(start):
    for number in (signal.SIGINT, signal.SIGTERM) * 3:  # at one moment or another of it
        node = start(sys.executable, '-m', 'cloth_ros.node.main')
        node.wait_for_output('preparing the kernels')
        assert node.stop(number) == 0
        assert 'Traceback' not in node.output


def test_a_sphere_far_away_is_refused_and_a_fast_one_is_not_too_much(start_cloth, probe):
    start_cloth('--params-file', 'config/gust.yaml')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    move = probe.publisher(PoseStamped, '/sphere_pose')
    move.publish(pose(x=4.5e5, y=8.5e5))
    probe.spin_until(lambda: diagnosis(probe)['rejected sphere_pose'] == '1')
    move.publish(pose(y=900.0, z=1.4))
    particles.clear()
    probe.spin_until(lambda: len(particles) > 60)
    assert np.isfinite(numbers(particles[-1])).all()


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
    example = start(sys.executable, 'examples/command.py', '--wind', '0', '0', '3')
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
    """The fixtures end what they start; this sees that they did."""
    children = Path(f'/proc/self/task/{os.getpid()}/children').read_text().split()
    names = [Path(f'/proc/{child}/cmdline').read_text() for child in children]
    assert not [name for name in names if 'cloth_node' in name]


def test_an_overload_coarsens_the_grid_and_keeps_time(start_cloth, probe):
    """Springs so stiff that no machine follows; softer ones are followed again."""
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
