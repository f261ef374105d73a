"""
First start of a node: times to the first particles, to motion and to the last kernel.

    python -m bench.first_start [--seconds 60] [--domain 97] [SCENE…]

For each scene, starts a node with an empty cache of kernels, and subscribes to its particles.
Prints the times from the start of the process to the first particles, to the first that move, and
to the end of all compilation; and the longest interval between the times at which the node sent
two messages, within --seconds after the first particles.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2

from cloth_ros.tradeoff.machine import describe_in_a_line

_ROOT = Path(__file__).parent.parent
_SCENES = ('config/gust.yaml', 'config/drop_on_sphere.yaml')
_LONGEST = 300.0  # s, for the first particles and for the last kernel
_LAST_KERNELS = 'compiled the kernels of the error estimate'


class Listener(Node):
    """Record when particles are sent, and when they first move."""

    def __init__(self, context: Context) -> None:
        super().__init__('first_start', context=context)
        self.sent: list[float] = []  # s, by the system clock
        self.moved: float | None = None
        self._first: np.ndarray | None = None
        self.create_subscription(PointCloud2, '/cloth/particles', self._receive, 1000)

    def _receive(self, message: PointCloud2, info: dict[str, int]) -> None:
        self.sent.append(1e-9 * info['source_timestamp'])
        if self.moved is None:
            numbers = np.frombuffer(message.data, np.float32)
            self._first = numbers.copy() if self._first is None else self._first
            if not np.array_equal(numbers, self._first):
                self.moved = self.sent[-1]


class Result(NamedTuple):
    """Times of a start, s, and the longest gap between two messages, s, and when it was, s."""

    first: float
    moved: float
    compiled: float
    gap: float
    gap_at: float


def measure(scene: str, seconds: float, domain: int) -> Result:
    """Start a node with a scene and an empty cache, record what it sends, and end it."""
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    listener, executor = Listener(context), SingleThreadedExecutor(context=context)
    executor.add_node(listener)
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryFile() as output:
        start = time.time()
        node = subprocess.Popen(
            [sys.executable, '-m', 'cloth_ros.node.main', '--ros-args', '--params-file', scene],
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain), 'NUMBA_CACHE_DIR': cache},
            stdout=output,
            stderr=subprocess.STDOUT,
            cwd=_ROOT,
        )
        compiled = None
        try:
            while time.time() < start + _LONGEST:
                executor.spin_once(timeout_sec=0.05)
                text = os.pread(output.fileno(), os.fstat(output.fileno()).st_size, 0)
                if node.poll() is not None:
                    raise SystemExit(f'the node has ended: {text.decode()}')
                if compiled is None and _LAST_KERNELS.encode() in text:
                    compiled = time.time()
                if compiled and listener.sent and time.time() > listener.sent[0] + seconds:
                    break
        finally:
            node.send_signal(signal.SIGINT)
            node.wait(30.0)
            rclpy.shutdown(context=context)
    if compiled is None or listener.moved is None:
        raise SystemExit(f'{scene}: no particles that move, or kernels, within {_LONGEST:g} s')
    gaps = np.diff(listener.sent)
    longest = int(np.argmax(gaps))
    return Result(
        listener.sent[0] - start,
        listener.moved - start,
        compiled - start,
        float(gaps[longest]),
        listener.sent[longest] - start,
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('scenes', nargs='*', default=_SCENES, metavar='SCENE')
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--domain', type=int, default=97, help='ROS domain without other nodes')
    arguments = parser.parse_args()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    print(describe_in_a_line())
    print(f'load of the machine before: {os.getloadavg()[0]:.2f}, {os.cpu_count()} cores')
    for scene in arguments.scenes:
        result = measure(scene, arguments.seconds, arguments.domain)
        print(
            f'{scene}: first particles after {result.first:.2f} s, first motion after '
            f'{result.moved:.2f} s, all kernels after {result.compiled:.1f} s; longest gap '
            f'between two ticks {result.gap:.3f} s, after {result.gap_at:.1f} s'
        )


if __name__ == '__main__':
    main()
