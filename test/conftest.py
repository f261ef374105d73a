"""Fixtures: a private ROS domain for each test, and a node as a process in it."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

ROOT = Path(__file__).parent.parent
PATIENCE = 90.0  # s, for what is bound to happen soon, kernels compiled on a slow machine among it


@pytest.fixture
def domain() -> Iterator[int]:
    """A ROS domain that no other test on this machine uses meanwhile."""
    for number in range(1, 101):
        path = Path(tempfile.gettempdir()) / f'cloth_ros-domain-{number}.lock'
        with path.open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield number
            return
    pytest.fail('no free ROS domain')


class Process:
    """A started process, with what it has printed."""

    def __init__(self, command: list[str], environment: dict[str, str]) -> None:
        self._output = tempfile.TemporaryFile('w+')  # noqa: SIM115, as long as the process
        self.process = subprocess.Popen(
            command, stdout=self._output, stderr=subprocess.STDOUT, env=environment, cwd=ROOT
        )

    @property
    def output(self) -> str:
        self._output.seek(0)
        return self._output.read()

    def wait_for_output(self, text: str) -> None:
        end = time.monotonic() + PATIENCE
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
            pytest.fail(f'did not end: {self.output}')


def environment(domain: int) -> dict[str, str]:
    return {
        **os.environ,
        'ROS_DOMAIN_ID': str(domain),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    }


@pytest.fixture
def start(domain: int) -> Iterator[Callable[..., Process]]:
    """Start a command in the domain; every process is ended after the test."""
    started: list[Process] = []

    def start_process(*command: str, **variables: str) -> Process:
        process = Process(list(command), {**environment(domain), **variables})
        started.append(process)
        return process

    yield start_process
    for process in started:
        process.stop(signal.SIGKILL)


@pytest.fixture
def start_cloth(start: Callable[..., Process]) -> Callable[..., Process]:
    """Start the node with parameters and other ROS arguments, and wait until it runs."""

    def start_node(*ros_arguments: str, **parameters: object) -> Process:
        arguments = list(ros_arguments)
        for name, value in parameters.items():
            arguments += ['-p', f'{name.replace("__", ".")}:={value}']
        node = start(sys.executable, '-m', 'cloth_ros.node.main', '--ros-args', *arguments)
        node.wait_for_output('publishing')
        return node

    return start_node


class Probe(Node):
    """A node of the test's own, in the same domain."""

    def __init__(self, context: Context) -> None:
        super().__init__('probe', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self)
        self._clients_by_name: dict[str, object] = {}

    def spin_until(self, condition: Callable[[], object], patience: float = PATIENCE) -> None:
        """Handle what arrives until the condition holds."""
        end = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < end, 'waited in vain'
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=max(end - time.monotonic(), 0.001))

    def collect(self, kind: type, topic: str, depth: int = 100) -> list:
        """Return a list that fills with the messages of a topic."""
        messages: list = []
        self.create_subscription(kind, topic, messages.append, depth)
        self.spin_until(lambda: self.count_publishers(topic) > 0)
        return messages

    def publisher(self, kind: type, topic: str):
        """Return a publisher that has been discovered."""
        publisher = self.create_publisher(kind, topic, 10)
        self.spin_until(publisher.get_subscription_count)
        return publisher

    def call(self, kind: type, service: str, request: object):
        """Call a service; once more where its answer was lost."""
        client = self._clients_by_name.get(service)
        if client is None:
            client = self._clients_by_name[service] = self.create_client(kind, service)
        self.spin_until(client.service_is_ready)
        for _ in range(5):
            future = client.call_async(request)
            end = time.monotonic() + 5.0
            # A server may answer before it has discovered where to: the answer is then dropped.
            self.spin_until(lambda: future.done() or time.monotonic() > end)  # noqa: B023
            if future.done():
                return future.result()
        pytest.fail(f'{service} does not answer')


@pytest.fixture
def probe(domain: int, monkeypatch: pytest.MonkeyPatch) -> Iterator[Probe]:
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node = Probe(context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)
