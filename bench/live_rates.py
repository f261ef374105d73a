"""
How a live node keeps up: its ticks, its messages, and what commands cost it.

    python -m bench.live_rates [--size 128] [--seconds 300] [--threads 1]

Starts a node, subscribes to its particles and markers from this process, and prints what arrives
and what the node's diagnostics say; then commands wind a thousand times a second, and prints what
that costs the node.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from rclpy.context import Context
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from cloth_ros.tradeoff.machine import describe

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from ros import NODE, Probe, Process, environment, free_domain, probing

_WIND_FOR = 10.0  # s, each with and without


class Listener(Probe):
    """Subscribes as a recorder does, without looking into the messages."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.arrivals: dict[str, list[float]] = {'particles': [], 'markers': []}
        self.reports: list[dict[str, str]] = []
        subscribe = self.create_subscription
        subscribe(PointCloud2, '/cloth/particles', self._note('particles'), 5, raw=True)
        subscribe(MarkerArray, '/cloth/markers', self._note('markers'), 5, raw=True)
        subscribe(DiagnosticArray, '/diagnostics', self._report, 5)
        self.wind = self.create_publisher(Vector3Stamped, '/wind', 5)

    def _note(self, topic: str) -> Callable[[bytes], None]:
        return lambda _: self.arrivals[topic].append(time.perf_counter())

    def _report(self, message: DiagnosticArray) -> None:
        (status,) = message.status
        self.reports.append({value.key: value.value for value in status.values})


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--size', type=int, default=128)
    parser.add_argument('--seconds', type=float, default=300.0)
    parser.add_argument('--threads', type=int, default=1)
    arguments = parser.parse_args()
    parameters = {
        'sheet.rows': arguments.size,
        'sheet.columns': arguments.size,
        'solver.threads': arguments.threads,
    }
    command = [*NODE, '--ros-args']
    for name, value in parameters.items():
        command += ['-p', f'{name}:={value}']
    with free_domain() as domain, probing(domain, Listener) as listener:
        start = time.perf_counter()
        node = Process(command, environment(domain))
        try:
            listener.spin_until(lambda: listener.arrivals['particles'])
            first = listener.arrivals['particles'][0] - start
            listener.spin_for(5.0)
            listener.reports.clear()
            for times in listener.arrivals.values():
                times.clear()
            used = node.cpu_seconds
            listener.spin_for(arguments.seconds)
            used = node.cpu_seconds - used
            report(listener, arguments.seconds, used, first)
            wind(listener, node)
        finally:
            node.end()


def report(listener: Listener, seconds: float, used: float, first: float) -> None:
    """Print what arrived."""
    print(', '.join(f'{name} {value}' for name, value in describe().items()))
    print(f'first particles {first:.2f} s after the start of the process')
    print(f'processor: {100 * used / seconds:.1f} % of a core')
    for topic, times in listener.arrivals.items():
        intervals = np.diff(times)
        missed = np.abs(intervals - np.median(intervals))
        print(
            f'{topic}: {len(times) / seconds:.2f} a second, intervals off by '
            f'{1e3 * np.percentile(missed, 99):.2f} ms (99th percentile), '
            f'{1e3 * missed.max():.1f} ms (greatest)'
        )
    for key in (
        'real-time factor',
        'load [share of real time]',
        'tick jitter, 99th percentile [s]',
        'messages, 99th percentile [s]',
    ):
        values = np.array([float(each[key]) for each in listener.reports])
        print(f'{key}: least {values.min():.4g}, median {np.median(values):.4g}, ', end='')
        print(f'greatest {values.max():.4g}')


def wind(listener: Listener, node: Process) -> None:
    """Print what commands cost, in turns with and without."""
    costs: dict[bool, list[float]] = {False: [], True: []}
    for blowing in (False, True) * 3:
        before, start, sent = node.cpu_seconds, time.perf_counter(), 0
        while time.perf_counter() - start < _WIND_FOR:
            if blowing and sent < 1000 * (time.perf_counter() - start):
                listener.wind.publish(Vector3Stamped())
                sent += 1
            else:
                listener.spin_for(2e-4)
        costs[blowing].append((node.cpu_seconds - before) / _WIND_FOR)
        if blowing:
            print(f'wind: {sent / _WIND_FOR:.0f} commands a second')
    calm, windy = (100 * float(np.median(costs[blowing])) for blowing in (False, True))
    print(f'processor without wind {calm:.1f} %, with {windy:.1f} % of a core')


if __name__ == '__main__':
    main()
