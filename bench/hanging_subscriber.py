"""
Pauses of a live cloth, and of one subscriber, while another subscriber hangs.

    python -m bench.hanging_subscriber --hangs 20 --locked
    python -m bench.hanging_subscriber --node FASTDDS_BUILTIN_TRANSPORTS=UDPv4

Intervals without and with a hang alternate.  With --locked the subscriber is stopped again and
again until it is stopped while it holds a lock of Fast DDS in shared memory.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from cloth_ros.live.tick_record import decode_record

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from reliability.held_locks import stop_holding_a_lock
from reliability.peers import PEER
from ros import NODE, Probe, Process, environment, free_domain, probing

_DEPTH = 1000  # of the queues here: what is lost is lost before


class Times:
    """Times, s, of ticks, by the node, and of the arrival of particles and markers."""

    def __init__(self, probe: Probe) -> None:
        self.times: dict[str, list[float]] = {'ticks': [], 'particles': [], 'markers': []}
        self._numbers: dict[str, list[int]] = {'particles': [], 'markers': []}
        probe.create_subscription(String, '/cloth/ticks', self._add_tick, _DEPTH)
        for kind, topic in ((PointCloud2, 'particles'), (MarkerArray, 'markers')):

            def add(_: bytes, info: dict[str, int], topic: str = topic) -> None:
                self.times[topic].append(time.monotonic())
                self._numbers[topic].append(info['publication_sequence_number'])

            probe.create_subscription(kind, f'/cloth/{topic}', add, _DEPTH, raw=True)

    def _add_tick(self, message: String) -> None:
        self.times['ticks'].append(1e-9 * decode_record(message.data).clock)

    def pauses(self, begin: float, end: float) -> list[float]:
        """Return the longest pause of each in an interval, s."""
        within = ([t for t in times if begin <= t <= end] for times in self.times.values())
        return [float(np.diff([begin, *times, end]).max()) for times in within]

    def lost(self, topic: str) -> tuple[int, int]:
        """Return how many messages were published but not received, and how many were."""
        numbers = self._numbers[topic]
        return numbers[-1] - numbers[0] + 1 - len(numbers), numbers[-1] - numbers[0] + 1


def variables(pairs: list[str]) -> dict[str, str]:
    """Return environment variables from NAME=VALUE."""
    return dict(pair.split('=', 1) for pair in pairs)


def options() -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--hangs', type=int, default=20)
    parser.add_argument('--seconds', type=float, default=2.5, help='of each hang')
    parser.add_argument('--rows', type=int, default=64, help='and columns of the sheet')
    parser.add_argument('--locked', action='store_true', help='stop it while it holds a lock')
    for name in ('node', 'subscriber'):
        text = f'environment of the {name}: NAME=VALUE …'
        parser.add_argument(f'--{name}', nargs='*', default=[], help=text)
    return parser.parse_args()


def main() -> None:
    """Measure, and print."""
    given = options()
    size = [f'sheet.{name}:={given.rows}' for name in ('rows', 'columns')]
    command = (*NODE, '--ros-args', '-p', size[0], '-p', size[1])
    with free_domain() as domain:
        here = environment(domain)
        node = Process(command, {**here, **variables(given.node)})
        processes = [node]
        try:
            node.wait_for_output('publishing')
            with probing(domain) as probe:
                times = Times(probe)
                probe.spin_until(lambda: all(times.times.values()))
                peer = Process((*PEER, 'subscribe'), {**here, **variables(given.subscriber)})
                processes.append(peer)
                peer.wait_for_output('begin')
                measure(given, probe, times, peer.process.pid)
        finally:
            for process in reversed(processes):
                process.stop(signal.SIGINT if process is node else signal.SIGKILL)


def measure(given: argparse.Namespace, probe: Probe, times: Times, pid: int) -> None:
    """Measure with a subscriber that hangs now and then."""
    pauses: dict[str, list[list[float]]] = {'without': [], 'with': []}
    tries = 0
    for number in range(given.hangs):
        probe.spin_for(1.0)
        for name, rows in pauses.items():
            if name == 'with' and given.locked:
                tries += stop_holding_a_lock(pid, probe.spin_for)
            elif name == 'with':
                os.kill(pid, signal.SIGSTOP)
            begin = time.monotonic()
            probe.spin_for(given.seconds)
            end = time.monotonic()
            os.kill(pid, signal.SIGCONT)
            probe.spin_for(1.0)  # what was sent before the end may arrive later
            rows.append(times.pauses(begin, end - 0.1))
        shown = '; '.join(f'{name} {np.round(rows[-1], 3)}' for name, rows in pauses.items())
        print(f'{number}: longest pauses of {", ".join(times.times)}, s: {shown}', flush=True)
    for name, rows in pauses.items():
        table = np.array(rows)
        print(
            f'{name} a hang: median {np.median(table, 0).round(3)}, longest '
            f'{table.max(0).round(3)}, over 0.05 s {(table > 0.05).sum(0)}, over 0.1 s '
            f'{(table > 0.1).sum(0)}, over 0.5 s {(table > 0.5).sum(0)} of {len(rows)}'
        )
    for topic in ('particles', 'markers'):
        lost, published = times.lost(topic)
        print(f'{topic}: {lost} of {published} lost ({lost / published:.1%})')
    if given.locked:
        print(f'a lock was held in {given.hangs} of {tries} tries')


if __name__ == '__main__':
    main()
