"""
Rates of a live node: ticks, messages, and processor time of commands.

    python -m bench.live_rates [--scene FILE] [--size 128] [--seconds 300] [--threads 1]
                               [--no-commands]

Starts a node with a scene, subscribes to its particles and markers from this process, resets the
cloth, and prints the rates of reception and the values of its diagnostics: a sheet that hangs by
default, gusts of `config/gust.yaml` from 5 s on, a fall on a sphere with
`config/drop_on_sphere.yaml`.  Then commands wind a thousand times per second, and prints the
processor time that the node needs for it.
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
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from cloth_ros import Scene
from cloth_ros.tradeoff.machine import describe_in_a_line

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from ros import NODE, Probe, Process, environment, free_domain, probing

# Values of the diagnostics, once a second.
_REPORTED = (
    'real-time factor',
    'load [share of real time]',
    'substeps in the last tick',
    'largest stretch',
    'tick jitter, 99th percentile [s]',
    'messages, 99th percentile [s]',
)
_COMMAND_FOR = 10.0  # s, of each period with and without commands


class Listener(Probe):
    """Subscribe as a recorder does, without deserialising the messages."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.received: dict[str, list[float]] = {'particles': [], 'markers': []}
        self.reports: list[dict[str, str]] = []
        subscribe = self.create_subscription
        subscribe(PointCloud2, '/cloth/particles', self._note('particles'), 5, raw=True)
        subscribe(MarkerArray, '/cloth/markers', self._note('markers'), 5, raw=True)
        subscribe(DiagnosticArray, '/diagnostics', self._report, 5)
        self.wind = self.create_publisher(Vector3Stamped, '/wind', 5)

    def _note(self, topic: str) -> Callable[[bytes], None]:
        return lambda _: self.received[topic].append(time.perf_counter())

    def _report(self, message: DiagnosticArray) -> None:
        (status,) = message.status
        self.reports.append({value.key: value.value for value in status.values})


def main() -> None:
    """Start a node, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--scene', type=Path, help='a file in config/; default: a hanging sheet')
    parser.add_argument('--size', type=int, default=128)
    parser.add_argument('--seconds', type=float, default=300.0)
    parser.add_argument('--threads', type=int, default=1)
    parser.add_argument(
        '--no-commands', action='store_true', help='leave out the part with commands, a minute'
    )
    arguments = parser.parse_args()
    parameters = {
        'sheet.rows': arguments.size,
        'sheet.columns': arguments.size,
        'solver.threads': arguments.threads,
    }
    rate = Scene.from_yaml(arguments.scene).rate if arguments.scene else Scene().rate
    command = [*NODE, '--ros-args']
    if arguments.scene is not None:
        command += ['--params-file', str(arguments.scene)]
    for name, value in parameters.items():
        command += ['-p', f'{name}:={value}']
    with free_domain() as domain, probing(domain, Listener) as listener:
        start = time.perf_counter()
        node = Process(command, environment(domain))
        try:
            listener.spin_until(lambda: listener.received['particles'])
            first = listener.received['particles'][0] - start
            # A node whose kernels are not compiled yet publishes a cloth that does not move.
            listener.spin_until(
                lambda: listener.reports and float(listener.reports[-1]['real-time factor']) > 0
            )
            listener.spin_for(5.0)
            assert listener.call(Trigger, '/cloth/reset', Trigger.Request()).success
            listener.spin_for(1.0)  # until a report is of the time after it
            listener.reports.clear()
            for times in listener.received.values():
                times.clear()
            used = node.cpu_seconds
            listener.spin_for(arguments.seconds)
            used = node.cpu_seconds - used
            report(listener, arguments.seconds, used, first, rate)
            if not arguments.no_commands:
                report_commands(listener, node)
        finally:
            node.end()


def report(listener: Listener, seconds: float, used: float, first: float, rate: float) -> None:
    """Print rates of reception, processor time, and values of the diagnostics."""
    print(describe_in_a_line())
    print(f'first particles {first:.2f} s after the start of the process')
    print(f'processor: {100 * used / seconds:.1f} % of a core')
    for topic, times in listener.received.items():
        intervals = np.diff(times)
        jitter = np.abs(intervals - np.median(intervals))
        print(
            f'{topic}: {len(times) / seconds:.2f} per second, jitter '
            f'{1e3 * np.percentile(jitter, 99):.2f} ms (99th percentile), '
            f'{1e3 * jitter.max():.1f} ms (largest)'
        )
    for key in _REPORTED:
        values = np.array([float(each[key]) for each in listener.reports if key in each])
        print(
            f'{key}: smallest {values.min():.4g}, median {np.median(values):.4g}, '
            f'largest {values.max():.4g}'
        )
    loads = 1e3 * np.array([float(each[_REPORTED[1]]) for each in listener.reports]) / rate
    print(
        f'simulation of a tick, ms of {1e3 / rate:.3g}: smallest {loads.min():.2f}, '
        f'median {np.median(loads):.2f}, largest {loads.max():.2f} (means of a second)'
    )


def report_commands(listener: Listener, node: Process) -> None:
    """Print the processor time with and without commands, measured alternately."""
    costs: dict[bool, list[float]] = {False: [], True: []}
    for commanding in (False, True) * 3:
        before, start, sent = node.cpu_seconds, time.perf_counter(), 0
        while time.perf_counter() - start < _COMMAND_FOR:
            if commanding and sent < 1000 * (time.perf_counter() - start):
                listener.wind.publish(Vector3Stamped())
                sent += 1
            else:
                listener.spin_for(2e-4)
        costs[commanding].append((node.cpu_seconds - before) / _COMMAND_FOR)
        if commanding:
            print(f'wind: {sent / _COMMAND_FOR:.0f} commands per second')
    calm, windy = (100 * float(np.median(costs[commanding])) for commanding in (False, True))
    print(f'processor: {calm:.1f} % of a core without commands, {windy:.1f} % with')


if __name__ == '__main__':
    main()
