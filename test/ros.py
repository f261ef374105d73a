"""Live nodes for tests: start them as processes, talk to them, and record what they publish."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import PointCloud2

ROOT = Path(__file__).parent.parent
NODE = (sys.executable, '-m', 'cloth_ros.node.main')
# Longest wait, s, for what must happen.  Only failing tests take that long: kernels may have to be
# compiled first, by a slow machine that is busy with other work.
PATIENCE = 240.0

# Parameters of a sheet that rests until something acts on it, and of a sphere out of its reach.
FLOATING = {
    'sheet__rows': 9,
    'sheet__columns': 9,
    'gravity': '[0.0, 0.0, 0.0]',
    'drag': 0.0,
    'solver__precision': 'double',
}
SPHERE = {'sphere__radius': 0.1, 'sphere__position': '[0.0, 0.0, 2.0]'}


@contextmanager
def free_domain() -> Iterator[int]:
    """Lock a ROS domain that no other test on this machine uses meanwhile."""
    for number in range(1, 101):
        path = Path(tempfile.gettempdir()) / f'cloth_ros-domain-{number}.lock'
        with path.open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            _remove_stale_ports(number)
            yield number
            return
    raise AssertionError('no free ROS domain')


def _remove_stale_ports(domain: int) -> None:
    # Killed participants leave ports in shared memory.  Who reuses one finds a mutex that is never
    # released, and may lose messages for seconds or for good.
    first = 7400 + 250 * domain  # by the standard of DDS
    for path in Path('/dev/shm').glob('*fastrtps_port*'):
        number = re.search(r'fastrtps_port(\d+)', path.name)
        if number is None or not first <= int(number[1]) < first + 250:
            continue
        owner = path.with_name(f'fastrtps_port{number[1]}_el')  # locked while its owner lives
        with suppress(OSError):
            if owner.exists():
                with owner.open('r+') as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()


def environment(domain: int) -> dict[str, str]:
    """Return the environment of a process in the domain, reachable from this machine only."""
    return {
        **os.environ,
        'ROS_DOMAIN_ID': str(domain),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    }


class Process:
    """A child process and its output."""

    def __init__(self, command: Sequence[str], environment: dict[str, str]) -> None:
        self._output = tempfile.TemporaryFile()  # noqa: SIM115, lives as long as the process
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            env=environment,
            cwd=ROOT,
        )

    @property
    def output(self) -> str:
        """Everything it has printed so far."""
        # Not `seek`: the process writes at the same file offset.
        file = self._output.fileno()
        return os.pread(file, os.fstat(file).st_size, 0).decode(errors='backslashreplace')

    def wait_for_output(self, text: str, patience: float = PATIENCE) -> None:
        """Wait until it has printed a text."""
        end = time.monotonic() + patience
        while text not in self.output:
            assert self.alive or text in self.output, self.output
            assert time.monotonic() < end, f'{text!r} not in: {self.output}'
            time.sleep(0.01)

    def stop(self, number: int = signal.SIGINT, patience: float = 60.0) -> int:
        """Send a signal (0: none), wait for the end, and return the exit code."""
        if self.alive:
            self.process.send_signal(number)
        try:
            return self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError(f'did not end: {self.output}') from None

    def end(self) -> None:
        """End it; killed only if necessary, which leaves half a megabyte of shared memory."""
        with suppress(AssertionError):
            self.stop()

    @property
    def alive(self) -> bool:
        """True while it runs."""
        return self.process.poll() is None

    @property
    def memory(self) -> float:
        """Resident memory without pages of files, which come and go, MB."""
        status = Path(f'/proc/{self.process.pid}/status').read_text()
        return sum(map(int, re.findall(r'Rss(?:Anon|Shmem):\s+(\d+)', status))) / 1024

    @property
    def cpu_seconds(self) -> float:
        """Processor time used so far, s."""
        stat = Path(f'/proc/{self.process.pid}/stat').read_text()
        fields = stat.rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


class Probe(Node):
    """A node in this process, in a context of its own."""

    def __init__(self, context: Context) -> None:
        super().__init__('probe', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self)
        self._clients_by_name: dict[str, object] = {}

    def spin_until(self, condition: Callable[[], object], patience: float = PATIENCE) -> None:
        """Handle messages until the condition holds."""
        end = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < end, 'the condition did not hold in time'
            self._executor.spin_once(timeout_sec=0.05)

    def handle_all(self, condition: Callable[[], object], wait: float = 0.05) -> object:
        """Handle all that has arrived, until a condition holds; wait so long, s, for the first."""
        end = time.monotonic() + 1.0  # a node may publish faster than is handled here
        while not (held := condition()) and time.monotonic() < end:
            try:
                handler, _, _ = self._executor.wait_for_ready_callbacks(timeout_sec=wait)
            except TimeoutException:
                break
            handler()
            if (error := handler.exception()) is not None:
                raise error
            wait = 0.0
        return held

    def spin_for(self, seconds: float) -> None:
        """
        Handle messages for some seconds, or a little longer.

        The timeout stays the same: with another one, rclpy discards what it has waited for.
        """
        end, timeout = time.monotonic() + seconds, min(seconds, 0.05)
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=timeout)

    def collect(self, kind: type, topic: str, depth: int = 100) -> list:
        """Return a list that fills with the messages of a topic."""
        messages: list = []
        self.create_subscription(kind, topic, messages.append, depth)
        self.spin_until(lambda: self.count_publishers(topic) > 0)
        return messages

    def publisher(self, kind: type, topic: str, depth: int = 10):
        """Return a publisher that the node has discovered."""
        publisher = self.create_publisher(kind, topic, depth)
        self.spin_until(publisher.get_subscription_count)
        return publisher

    def client(self, kind: type, service: str):
        """Return a client of a service that is available."""
        client = self._clients_by_name.get(service)
        if client is None:
            client = self._clients_by_name[service] = self.create_client(kind, service)
        self.spin_until(client.service_is_ready)
        return client

    def call(self, kind: type, service: str, request: object):
        """Call a service and return its response; retry where the response was lost."""
        client = self.client(kind, service)
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            future = client.call_async(request)
            retry = time.monotonic() + 5.0
            # A server may answer before it has discovered the client: the response is dropped.
            self.spin_until(lambda: future.done() or time.monotonic() > retry)  # noqa: B023
            if future.done():
                return future.result()
            client.remove_pending_request(future)
        raise AssertionError(f'{service} does not answer')


P = TypeVar('P', bound=Probe)


@contextmanager
def probing(domain: int, make: Callable[[Context], P] = Probe) -> Iterator[P]:
    """Provide a probe in the domain."""
    # rclpy reads the range from the environment only.
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    try:
        node = make(context)
        yield node
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)


def stamp(message) -> float:
    """Return the time in the header, s."""
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def numbers(cloud: PointCloud2) -> np.ndarray:
    """Return positions and velocities, m and m/s, (rows, columns, 6), or positions alone."""
    values = np.frombuffer(cloud.data, np.float32)
    return values.reshape(cloud.height, cloud.width, cloud.point_step // 4)


def wind(x=0.0, y=0.0, z=0.0, frame='') -> Vector3Stamped:
    """Return a command of the wind, m/s."""
    message = Vector3Stamped()
    message.header.frame_id = frame
    message.vector.x, message.vector.y, message.vector.z = x, y, z
    return message


def pose(x=0.0, y=0.0, z=0.0, frame='') -> PoseStamped:
    """Return a command of the sphere's centre, m."""
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y, message.pose.position.z = x, y, z
    return message


def parameter_request(values: Mapping[str, object]) -> SetParameters.Request:
    """Return a request to set parameters by name; a list or tuple is an array."""
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    return SetParameters.Request(parameters=[each.to_parameter_msg() for each in parameters])


def set_parameters(probe: Probe, **values: object) -> list[SetParametersResult]:
    """Set parameters of the node (`__` stands for a dot), and return its results."""
    named = {name.replace('__', '.'): value for name, value in values.items()}
    request = parameter_request(named)
    return probe.call(SetParameters, '/cloth/set_parameters', request).results


def dumped(values: dict[str, object], node: str = '/cloth') -> str:
    """Return what `ros2 param dump` writes."""
    tree: dict = {}
    for name, value in sorted(values.items()):
        *groups, last = name.split('.')
        place = tree
        for group in groups:
            place = place.setdefault(group, {})
        place[last] = value
    return yaml.dump({node: {'ros__parameters': tree}}, default_flow_style=False)


def publish_until(
    condition: Callable[[], object], probe: Probe, publisher, messages: Iterator
) -> None:
    """
    Publish messages until a condition holds; a busy node takes only the newest of them.

    All that has arrived is handled before the next message is published: a probe with several
    subscriptions would otherwise fall behind the node, ever further.
    """
    end = time.monotonic() + PATIENCE
    publisher.publish(next(messages))
    while not probe.handle_all(condition):
        assert time.monotonic() < end, 'the condition did not hold in time'
        publisher.publish(next(messages))


def diagnosis(probe: Probe) -> dict[str, str]:
    """Return the values of the next diagnostics, with `name`, `message` and `level`."""
    messages = probe.collect(DiagnosticArray, '/diagnostics')
    probe.spin_until(lambda: messages)
    status = messages[0].status[0]
    return {
        'name': status.name,
        'message': status.message,
        'level': status.level,
        **{item.key: item.value for item in status.values},
    }


def regular(stamps: list[float], period: float) -> bool:
    """Return True if the newest 30 stamps keep a period, as their median."""
    newest = stamps[-30:]
    return len(newest) == 30 and abs(np.median(np.diff(newest)) - period) < 0.05 * period


class ReceivedCloud(NamedTuple):
    """Reception of one message of particles."""

    at: float  # s, by the steady clock here
    sent: float  # s, by the system clock of the node
    stamp: float  # s, in the header
    number: int  # of its publisher


class Report(NamedTuple):
    """One message of /diagnostics, received at a time in s."""

    at: float
    level: bytes
    message: str
    values: dict[str, str]

    @property
    def simulated(self) -> float:
        """Simulated time, s."""
        return float(self.values['simulated time [s]'])

    @property
    def factor(self) -> float:
        """Real-time factor since the previous report."""
        return float(self.values['real-time factor'])


class Listener(Probe):
    """Records particles and reports of the node, and how many particles are not finite."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.particles: list[ReceivedCloud] = []
        self.reports: list[Report] = []
        self.not_finite = 0
        depth = 1000  # what is lost is then lost by the node, not here
        self.create_subscription(PointCloud2, '/cloth/particles', self._on_particles, depth)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_report, depth)

    def _on_particles(self, message: PointCloud2, info: dict[str, int]) -> None:
        sent, number = 1e-9 * info['source_timestamp'], info['publication_sequence_number']
        self.particles.append(ReceivedCloud(time.monotonic(), sent, stamp(message), number))
        self.not_finite += not np.isfinite(numbers(message)).all()

    def _on_report(self, message: DiagnosticArray) -> None:
        (status,) = message.status
        values = {item.key: item.value for item in status.values}
        self.reports.append(Report(time.monotonic(), status.level, status.message, values))

    def next_report(self, count: int = 1) -> Report:
        """Wait for so many more reports, and return the last of them."""
        end = len(self.reports) + count
        self.spin_until(lambda: len(self.reports) >= end)
        return self.reports[-1]
