"""Nodes that serve many tests: starting one takes some two seconds."""

from __future__ import annotations

import itertools
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.duration import Duration
from rclpy.parameter import parameter_value_to_python
from ros import (
    FLOATING,
    NODE,
    PATIENCE,
    SPHERE,
    Probe,
    Process,
    environment,
    free_domain,
    numbers,
    parameter_request,
    pose,
    probing,
    publish_until,
    set_parameters,
    stamp,
    wind,
)
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

from cloth_ros.scene.parameter import PARAMETERS

_SHARED_MEMORY = 2**24  # bytes
_GRAVITY = -9.81  # m/s²
# Parameters of a sheet that falls freely, of which one substep of any length is exact.
FREE_FALL = {
    'pins': [''],
    'gravity': [0.0, 0.0, _GRAVITY],
    'drag': 0.0,
    'wind.air_density': 0.0,
    'sphere.radius': 0.0,
    'springs.structural': 0.0,
    'springs.shear': 0.0,
    'springs.bending': 0.0,
}
PERIOD = 0.02  # s, of the ticks of the stepped node


def at_rest(state: np.ndarray) -> bool:
    """Return True if no particle moves, but for rounding errors."""
    return bool(np.abs(state[..., 3:]).max() < 1e-6)


def durations(messages: Sequence[PointCloud2]) -> np.ndarray:
    """
    Return the times between the stamps of states in free fall, s.

    They are checked against the motion: a state is that of the time of its stamp.
    """
    seconds = []
    for first, last in itertools.pairwise(messages):
        seconds.append(stamp(last) - stamp(first))
        before, after = numbers(first), numbers(last)
        fall = [0.0, 0.0, _GRAVITY * seconds[-1]]
        np.testing.assert_allclose(after[..., 3:] - before[..., 3:] - fall, 0.0, atol=0.01)
        mean = (before[..., 3:] + after[..., 3:]) / 2
        moved = after[..., :3] - before[..., :3]
        np.testing.assert_allclose(moved, mean * seconds[-1], atol=0.01)
    return np.array(seconds)


def check_shared_memory(process: Process) -> None:
    """Check that a node has a large segment of shared memory for its messages."""
    if shutil.disk_usage('/dev/shm').free > 2 * _SHARED_MEMORY:
        maps = Path(f'/proc/{process.process.pid}/maps').read_text()
        segments = set(re.findall(r'/dev/shm/fastrtps_[0-9a-f]{16}$', maps, re.MULTILINE))
        assert max(Path(each).stat().st_size for each in segments) > _SHARED_MEMORY


@contextmanager
def running(*ros_arguments: str, **parameters: object) -> Iterator[tuple[Process, Probe]]:
    """Run a node with ROS arguments and parameters, and a probe in its domain."""
    arguments = list(ros_arguments)
    for name, value in parameters.items():
        arguments += ['-p', f'{name.replace("__", ".")}:={value}']
    with free_domain() as domain:
        process = Process((*NODE, '--ros-args', *arguments), environment(domain))
        try:
            process.wait_for_output('publishing')
            with probing(domain) as probe:
                yield process, probe
        finally:
            process.end()


def _clock_message(nanoseconds: int) -> Clock:
    message = Clock()
    message.clock.sec, message.clock.nanosec = divmod(nanoseconds, 10**9)
    return message


class SteppedCloth:
    """
    A node that follows /clock, which only moves when a test says so.

    Tests of it take no account of wall-clock time: however slow the machine, each tick publishes
    one state, and what was sent before the tick is handled before it.
    """

    def __init__(self, process: Process, probe: Probe) -> None:
        self.process, self.probe = process, probe
        self.states: list[PointCloud2] = probe.collect(PointCloud2, '/cloth/particles', 1000)
        self._clock = probe.publisher(Clock, '/clock')
        self.now = 10**12  # ns
        self._publishers = {
            '/wind': probe.publisher(Vector3Stamped, '/wind'),
            '/sphere_pose': probe.publisher(PoseStamped, '/sphere_pose'),
        }
        for topic, message in (('/wind', wind()), ('/sphere_pose', pose(z=2.0))):
            self.send_and_wait(topic, message)  # from here on, nothing waits for discovery
        self.tick_until(lambda _: True)  # the node has discovered clock and subscription
        self._initial = self.parameters()

    def _clock_messages(self, seconds: float) -> Iterator[Clock]:
        while True:
            self.now += round(1e9 * seconds)
            yield _clock_message(self.now)

    def send_time(self, seconds: float) -> None:
        """Publish once that /clock is so many seconds ahead, which need not cause a tick."""
        self._clock.publish(_clock_message(self.now + round(1e9 * seconds)))

    def tick(self, count: int = 1, seconds: float = PERIOD) -> list[np.ndarray]:
        """Move /clock so many times by so many seconds; return the states published."""
        first = len(self.states)
        for _ in range(count):
            # Again and again: subscriptions to /clock are best-effort.
            messages = itertools.repeat(next(self._clock_messages(seconds)))
            number = len(self.states)
            ticked = lambda: len(self.states) > number  # noqa: B023, E731
            publish_until(ticked, self.probe, self._clock, messages)
        return [numbers(state) for state in self.states[first:]]

    def tick_until(self, condition: Callable[[np.ndarray], object]) -> np.ndarray:
        """Move /clock until a condition holds for the newest state; return that."""
        first = len(self.states)
        publish_until(
            lambda: len(self.states) > first and condition(numbers(self.states[-1])),
            self.probe,
            self._clock,
            self._clock_messages(PERIOD),
        )
        self.probe.spin_for(0.05)  # what is still on its way
        return numbers(self.states[-1])

    def jump(self, seconds: float) -> None:
        """Have /clock jump, and move on until the node has followed."""
        self.now += round(1e9 * seconds)
        self.tick_until(lambda _: abs(stamp(self.states[-1]) - 1e-9 * self.now) < 1.0)

    def send(self, topic: str, *messages: object) -> None:
        """Publish messages on a topic for commands."""
        for message in messages:
            self._publishers[topic].publish(message)

    def send_and_wait(self, topic: str, *messages: object) -> None:
        """Publish messages, and wait until the node has received them, which takes up to 3 s."""
        self.send(topic, *messages)
        assert self._publishers[topic].wait_for_all_acked(Duration(seconds=60))

    def parameters(self) -> dict[str, object]:
        """Return the parameters of the scene by name."""
        request = GetParameters.Request(names=list(PARAMETERS))
        values = self.probe.call(GetParameters, '/cloth/get_parameters', request).values
        return {
            name: parameter_value_to_python(value)
            for name, value in zip(PARAMETERS, values, strict=True)
        }

    def set(self, **values: object) -> list[str]:
        """Set parameters one by one (`__` stands for a dot); return why each was rejected."""
        return [result.reason for result in set_parameters(self.probe, **values)]

    def set_together(self, values: dict[str, object]) -> str:
        """Set parameters together; return why they were rejected."""
        request = SetParametersAtomically.Request(parameters=parameter_request(values).parameters)
        service = '/cloth/set_parameters_atomically'
        return self.probe.call(SetParametersAtomically, service, request).result.reason

    def pause(self, data: bool) -> None:
        """Pause or continue."""
        assert self.probe.call(SetBool, '/cloth/pause', SetBool.Request(data=data)).success

    def reset(self) -> None:
        """Return to the initial state."""
        assert self.probe.call(Trigger, '/cloth/reset', Trigger.Request()).success

    def remove_colliders(self, *names: str) -> None:
        """
        Remove all colliders but the sphere; wait until topics and markers of these names are gone.

        Else a later publisher may take the subscription that was destroyed for the new one.
        """
        markers: list[MarkerArray] = []
        subscription = self.probe.create_subscription(
            MarkerArray, '/cloth/markers', markers.append, 10
        )
        self.tick_until(lambda _: markers)
        assert self.set(collider__names=['']) == ['']
        for name in names:
            self.probe.spin_until(lambda: not self.probe.count_subscribers(f'/{name}/pose'))  # noqa: B023
        markers.clear()
        self.tick_until(
            lambda _: markers and not {each.ns for each in markers[-1].markers} & set(names)
        )
        self.probe.destroy_subscription(subscription)

    def restore(self) -> None:
        """Return to the initial state with the initial parameters."""
        assert self.set_together(self._initial) == ''
        self.pause(False)
        end = time.monotonic() + PATIENCE
        while True:
            # Again, if the parameters take effect after it: their kernels had to be compiled.
            self.reset()
            if any(at_rest(self.tick()[-1]) for _ in range(10)):
                return
            assert time.monotonic() < end, 'the sheet is not at rest after a reset'


@pytest.fixture(scope='session')
def stepped_node() -> Iterator[SteppedCloth]:
    with running(use_sim_time='true', rate=1 / PERIOD, **FLOATING, **SPHERE) as (process, probe):
        yield SteppedCloth(process, probe)


@pytest.fixture
def cloth(stepped_node: SteppedCloth) -> Iterator[SteppedCloth]:
    """The stepped node in its initial state: a sheet that floats at z = 1, a sphere above it."""
    stepped_node.restore()
    probe = stepped_node.probe
    before = set(probe.subscriptions)
    yield stepped_node
    for subscription in set(probe.subscriptions) - before:  # of the test, which has ended
        probe.destroy_subscription(subscription)


@pytest.fixture(scope='session', autouse=True)
def _no_process_is_left() -> Iterator[None]:
    """Every node and every child process of it has ended when the tests have."""
    yield
    children = Path(f'/proc/self/task/{os.getpid()}/children').read_text().split()
    names = [Path(f'/proc/{child}/cmdline').read_text() for child in children]
    assert not [name for name in names if 'cloth_ros' in name]
