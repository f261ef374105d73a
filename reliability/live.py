"""A live node in a process of its own, and a listener in this one, on a ROS domain of theirs."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool

from .arrivals import OK, Arrival, Report, Ticks, lost

ROOT = Path(__file__).parent.parent
PATIENCE = 90.0  # s, for what is bound to happen soon, kernels compiled on a slow machine among it
SOON = 30.0  # s, within which a node must be well again once a fault is over
NODE = (sys.executable, '-m', 'cloth_ros.node.main')
# Ticks at a stretch that make a full rate, and what they may take of the time that is meant: a
# burst of messages that have waited is none.
_STEADY = 30
_LEAST, _MOST = 0.8, 1.1


@contextmanager
def free_domain() -> Iterator[int]:
    """Hold a ROS domain that no one else on this machine uses meanwhile."""
    for number in range(1, 101):
        path = Path(tempfile.gettempdir()) / f'cloth_ros-domain-{number}.lock'
        with path.open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            _forget_killed(number)
            yield number
            return
    raise AssertionError('no free ROS domain')


def _forget_killed(domain: int) -> None:
    """
    Remove the ports in shared memory that killed participants have left in a domain.

    Whoever takes one next finds a mutex that no one releases any more, and may lose what is sent
    to it for seconds, or from then on.
    """
    first = 7400 + 250 * domain  # by the standard of DDS
    for path in Path('/dev/shm').glob('*fastrtps_port*'):
        number = re.search(r'fastrtps_port(\d+)', path.name)
        if number is None or not first <= int(number[1]) < first + 250:
            continue
        held = path.with_name(f'fastrtps_port{number[1]}_el')  # locked by who lives
        with suppress(OSError):
            if held.exists():
                with held.open('r+') as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()


def environment(domain: int) -> dict[str, str]:
    """Return the variables of a process in the domain, reached from this machine alone."""
    return {
        **os.environ,
        'ROS_DOMAIN_ID': str(domain),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    }


def to_set(values: Mapping[str, object]) -> SetParameters.Request:
    """Return a request to set parameters by name; a list or tuple is an array."""
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    return SetParameters.Request(parameters=[each.to_parameter_msg() for each in parameters])


class Process:
    """A started process, with what it has printed."""

    def __init__(self, command: Sequence[str], environment: dict[str, str]) -> None:
        # As long as the process.
        self._output = tempfile.TemporaryFile()  # noqa: SIM115
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
        """All that it has printed so far."""
        # Not `seek`: the place in the file is the one where the process writes.
        file = self._output.fileno()
        return os.pread(file, os.fstat(file).st_size, 0).decode(errors='backslashreplace')

    def wait_for_output(self, text: str, patience: float = PATIENCE) -> None:
        """Wait until it has printed this text."""
        end = time.monotonic() + patience
        while text not in self.output:
            assert self.process.poll() is None, self.output
            assert time.monotonic() < end, f'{text!r} not in: {self.output}'
            time.sleep(0.01)

    def stop(self, number: int = signal.SIGINT, patience: float = 10.0) -> int:
        """Send a signal, and return the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError(f'did not end: {self.output}') from None

    def end(self) -> None:
        """End it, killed only if it must be: that leaves half a megabyte of shared memory."""
        with suppress(AssertionError):
            self.stop()

    @property
    def alive(self) -> bool:
        """True while it runs."""
        return self.process.poll() is None

    @property
    def memory(self) -> float:
        """
        Resident memory of its own, MB.

        Pages of files, its libraries among them, are left out: the kernel drops them when they are
        not used for a while, and reads them again when they are.
        """
        status = Path(f'/proc/{self.process.pid}/status').read_text()
        kilobytes = re.findall(r'Rss(?:Anon|Shmem):\s+(\d+)', status)
        return sum(map(int, kilobytes)) / 1024

    @property
    def cpu_seconds(self) -> float:
        """Processor time used so far, s."""
        stat = Path(f'/proc/{self.process.pid}/stat').read_text()
        fields = stat.rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


class Probe(Node):
    """A node in this process."""

    def __init__(self, context: Context) -> None:
        super().__init__('probe', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self)
        self._clients_by_name: dict[str, object] = {}

    def spin_until(self, condition: Callable[[], object], patience: float | None = None) -> None:
        """Handle what arrives until the condition holds."""
        end = time.monotonic() + (patience or PATIENCE)
        while not condition():
            assert time.monotonic() < end, 'waited in vain'
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds: float) -> None:
        """Handle what arrives for some seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=max(end - time.monotonic(), 0.001))

    def collect(self, kind: type, topic: str, depth: int = 100) -> list:
        """Return a list that fills with the messages of a topic."""
        messages: list = []
        self.create_subscription(kind, topic, messages.append, depth)
        self.spin_until(lambda: self.count_publishers(topic) > 0)
        return messages

    def publisher(self, kind: type, topic: str, depth: int = 10):
        """Return a publisher that has been discovered."""
        publisher = self.create_publisher(kind, topic, depth)
        self.spin_until(publisher.get_subscription_count)
        return publisher

    def client(self, kind: type, service: str):
        """Return a client of a service that is there."""
        client = self._clients_by_name.get(service)
        if client is None:
            client = self._clients_by_name[service] = self.create_client(kind, service)
        self.spin_until(client.service_is_ready)
        return client

    def call(self, kind: type, service: str, request: object):
        """Call a service; once more where its answer was lost."""
        client = self.client(kind, service)
        for _ in range(5):
            future = client.call_async(request)
            end = time.monotonic() + 5.0
            # A server may answer before it has discovered where to: the answer is then dropped.
            self.spin_until(lambda: future.done() or time.monotonic() > end)  # noqa: B023
            if future.done():
                return future.result()
            client.remove_pending_request(future)
        raise AssertionError(f'{service} does not answer')

    def set_parameters_of_cloth(self, values: Mapping[str, object]) -> list[SetParametersResult]:
        """Set parameters of the node by name, and return what it says to each."""
        return self.call(SetParameters, '/cloth/set_parameters', to_set(values)).results


P = TypeVar('P', bound=Probe)


@contextmanager
def probing(domain: int, make: Callable[[Context], P] = Probe) -> Iterator[P]:
    """Have a probe in the domain."""
    # Read from the environment alone.
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    try:
        node = make(context)
        yield node
        node.destroy_node()
    finally:
        rclpy.shutdown(context=context)


class Listener(Probe):
    """
    Notes what arrives from the node.

    Attributes
    ----------
    particles, reports
        Messages of the two topics.
    not_finite
        Messages of particles with a number in them that is none.

    """

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.particles: list[Arrival] = []
        self.reports: list[Report] = []
        self.not_finite = 0
        # Deep, so that what is lost is lost by the node and not here.
        deep = QoSProfile(depth=1000)
        self.create_subscription(PointCloud2, '/cloth/particles', self._on_particles, deep)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_report, deep)

    def _on_particles(self, message: PointCloud2, info: dict[str, int]) -> None:
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        sent, number = 1e-9 * info['source_timestamp'], info['publication_sequence_number']
        self.particles.append(Arrival(time.monotonic(), sent, stamp, number))
        self.not_finite += not np.isfinite(np.frombuffer(message.data, np.float32)).all()

    def _on_report(self, message: DiagnosticArray) -> None:
        (status,) = message.status
        values = {item.key: item.value for item in status.values}
        self.reports.append(Report(time.monotonic(), status.level, status.message, values))


class Live:
    """
    A node that publishes, and who listens to it.

    Attributes
    ----------
    domain, node, listener
        The ROS domain; the process; the probe in this one.
    rate
        Of the ticks, Hz.

    """

    def __init__(self, domain: int, node: Process, listener: Listener, rate: float) -> None:
        self.domain = domain
        self.node = node
        self.listener = listener
        self.rate = rate

    def beside(self, *command: str) -> Process:
        """Start another process in the domain; who starts it ends it."""
        return Process(command, environment(self.domain))

    def recover(self, after: float, patience: float | None = None) -> float:
        """
        Wait until the node has its full rate and keeps real time again.

        Full rate is half a second of it at a stretch; real time is what the diagnostics say.
        Returned is how long after a moment, s, the first of these ticks came.
        """
        listener, meant = self.listener, _STEADY / self.rate

        def full_rate() -> float | None:
            first = bisect_left(listener.particles, after, key=lambda each: each.at)
            times = [each.at for each in listener.particles[first:]]
            pairs = zip(times, times[_STEADY:], strict=False)
            return next(
                (first for first, last in pairs if _LEAST < (last - first) / meant < _MOST), None
            )

        def healthy() -> bool:
            reports = listener.reports
            # The first report after the moment may speak of the time before.
            return len(reports) > 1 and reports[-2].at > after and reports[-1].level == OK

        listener.spin_until(lambda: full_rate() is not None and healthy(), patience)
        return (full_rate() or after) - after

    def spin_until_stamped(self, moment: float) -> None:
        """Wait for particles that are stamped with a moment, s, or the minute around it."""
        listener = self.listener
        listener.spin_until(lambda: abs(listener.particles[-1].stamp - moment) < 60)

    def next_report(self) -> Report:
        """Wait for a report, and return it."""
        reports = self.listener.reports
        count = len(reports)
        self.listener.spin_until(lambda: len(reports) > count)
        return reports[-1]

    def ticks(self, since: float, until: float, *, by_arrival: bool = False) -> Ticks:
        """Return how the ticks went; by arrival where a sender's clock jumps."""
        window = [each for each in self.listener.particles if since <= each.at <= until]
        due = int((until - since) * self.rate)
        if len(window) < 2:
            return Ticks(0, 0, due, until - since, 0)
        pauses = np.diff([each.at if by_arrival else each.sent for each in window])
        late = int((pauses > 1.5 / self.rate).sum())
        missing = max(due - len(window), 0)
        return Ticks(len(pauses), late, missing, float(pauses.max()), lost(window))

    def least_factor(self, since: float, until: float) -> float:
        """Return the least real-time factor of whole seconds in a stretch of time; 0: none."""
        reports = [each for each in self.listener.reports if since < each.at <= until]
        # The first may speak of the time before.
        return min((each.factor for each in reports[1:]), default=0.0)

    def well(self) -> bool:
        """Tell if the node lives, answers, and has published nothing that is not finite."""
        answer = self.listener.call(SetBool, '/cloth/pause', SetBool.Request(data=False))
        return self.node.alive and answer.success and not self.listener.not_finite


@contextmanager
def live(*ros_arguments: str, rate: float = 60.0, variables: dict[str, str] | None = None):
    """
    Start a node, and listen to it until it keeps real time.

    Parameters
    ----------
    *ros_arguments
        Of the node.
    rate
        Of its ticks, Hz.
    variables
        Of its environment, beside the usual ones.

    """
    with free_domain() as domain:
        command = (*NODE, '--ros-args', '-p', f'rate:={rate}', *ros_arguments)
        node = Process(command, {**environment(domain), **(variables or {})})
        # As by Ctrl-C, so that the node does not stay behind.
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            # One after the other: Fast DDS may miss a participant that starts at the same moment
            # where one was killed before.
            node.wait_for_output('publishing')
            with probing(domain, Listener) as listener:
                running = Live(domain, node, listener, rate)
                running.recover(time.monotonic())
                yield running
        finally:
            node.end()
            signal.signal(signal.SIGTERM, before)
