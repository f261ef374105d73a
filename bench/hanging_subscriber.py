"""
Pauses of a live cloth, and of a subscriber, while another subscriber hangs.

    python -m bench.hanging_subscriber --hangs 20 --locked
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import time
from pathlib import Path

import msgspec
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from reliability.held_locks import stop_holding_a_lock
from ros import NODE, Process, environment, free_domain, probing

PEER = (sys.executable, str(Path(__file__).parents[1] / 'test/reliability/peers.py'))


class Watch:
    def __init__(self, probe) -> None:
        self.probe = probe
        self.ticks: list[float] = []
        self.particles: list[float] = []
        self.markers: list[float] = []
        self.numbers: dict[str, list[int]] = {}
        probe.create_subscription(String, '/cloth/ticks', self._on_tick, 1000)
        for kind, topic, times in (
            (PointCloud2, 'particles', self.particles),
            (MarkerArray, 'markers', self.markers),
        ):

            def add(_, info, times=times, numbers=self.numbers.setdefault(topic, [])):
                times.append(time.monotonic())
                numbers.append(info['publication_sequence_number'])

            probe.create_subscription(kind, f'/cloth/{topic}', add, 100, raw=True)

    def _on_tick(self, message) -> None:
        self.ticks.append(1e-9 * msgspec.json.decode(message.data)['clock'])

    def pauses(self, begin: float, end: float, offset: float) -> tuple[float, float, float]:
        def longest(times, begin, end):
            kept = [each for each in times if begin <= each <= end]
            return float(np.diff([begin, *kept, end]).max())

        return (
            longest(self.ticks, begin + offset, end + offset),
            longest(self.particles, begin, end),
            longest(self.markers, begin, end),
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--hangs', type=int, default=20)
    parser.add_argument('--seconds', type=float, default=2.5)
    parser.add_argument('--rows', type=int, default=64)
    parser.add_argument('--locked', action='store_true')
    parser.add_argument('--victim', nargs='*', default=[], help='NAME=VALUE of its environment')
    parser.add_argument('--node', nargs='*', default=[])
    a = parser.parse_args()
    extra = lambda pairs: dict(each.split('=', 1) for each in pairs)
    with free_domain() as domain:
        here = environment(domain)
        size = ('-p', f'sheet.rows:={a.rows}', '-p', f'sheet.columns:={a.rows}')
        node = Process((*NODE, '--ros-args', *size), {**here, **extra(a.node)})
        victim = None
        try:
            node.wait_for_output('publishing')
            with probing(domain) as probe:
                watch = Watch(probe)
                probe.spin_until(lambda: watch.markers and watch.ticks)
                victim = Process((*PEER, 'subscribe'), {**here, **extra(a.victim)})
                victim.wait_for_output('begin')
                pid = victim.process.pid
                results = {'background': [], 'hang': []}
                tries = []
                for n in range(a.hangs):
                    probe.spin_for(1.0)
                    offset = 0.0
                    began = time.monotonic()
                    probe.spin_for(a.seconds)
                    ended = time.monotonic()
                    probe.spin_for(0.3)
                    results['background'].append(watch.pauses(began, ended - 0.1, offset))
                    if a.locked:
                        number = stop_holding_a_lock(pid, probe.spin_for)
                        tries.append(number)
                    else:
                        time.sleep(random.uniform(0, 0.02))
                        os.kill(pid, signal.SIGSTOP)
                    began = time.monotonic()
                    if os.environ.get('STACK') and n == 0:
                        probe.spin_for(0.3)
                        os.system(f'{os.environ["STACK"]} {node.process.pid}')
                    probe.spin_for(a.seconds - (time.monotonic() - began))
                    ended = time.monotonic()
                    os.kill(pid, signal.SIGCONT)
                    probe.spin_for(1.0)
                    results['hang'].append(watch.pauses(began, ended - 0.1, offset))
                    print(
                        n,
                        tries[-1:],
                        'hang',
                        np.round(results['hang'][-1], 3),
                        'bg',
                        np.round(results['background'][-1], 3),
                        flush=True,
                    )
                for topic, n in watch.numbers.items():
                    print(topic, 'received', len(n), 'lost', n[-1] - n[0] + 1 - len(n))
                print('tries', tries, sum(tries), 'for', sum(map(bool, tries)))
                for name, rows in results.items():
                    rows = np.array(rows)
                    print(
                        name,
                        len(rows),
                        'median',
                        np.median(rows, 0).round(3),
                        'max',
                        rows.max(0).round(3),
                        '>0.05',
                        (rows > 0.05).sum(0),
                        '>0.1',
                        (rows > 0.1).sum(0),
                        '>0.5',
                        (rows > 0.5).sum(0),
                    )
                print([l for l in node.output.splitlines() if 'WARN' in l or 'Trace' in l][-5:])
        finally:
            if victim:
                victim.stop(signal.SIGKILL)
            node.end()


if __name__ == '__main__':
    main()
