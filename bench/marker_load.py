"""
Load of the markers by size of the sheet: bytes, rate, and processor time of the node.

    python -m bench.marker_load [--seconds 10] [--page docs/topics.md]

For each size, starts a node with the default scene, and subscribes to its markers as a recorder
does, without deserialising them.  The processor time is that with the subscriber minus that
without, measured alternately.  Writes the table into the page.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from rclpy.context import Context
from visualization_msgs.msg import MarkerArray

from cloth_ros import Scene
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe
from tools.marked_block import fill

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from ros import NODE, Listener, Process, environment, free_domain, probing

_SIZES = (32, 64, 128)
_NAME = 'python -m bench.marker_load'
_REPEATS = 3


class MarkerListener(Listener):
    """Subscribe to the markers while that is wanted."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.sizes: list[int] = []  # bytes

    def measure(self, node: Process, seconds: float, subscribed: bool) -> float:
        """Return the share of a core that the node uses, with or without a subscriber."""
        subscription = None
        if subscribed:
            subscription = self.create_subscription(
                MarkerArray,
                '/cloth/markers',
                lambda data: self.sizes.append(len(data)),
                5,
                raw=True,
            )
            known = len(self.sizes)
            self.spin_until(lambda: len(self.sizes) > known + 1)
        self.spin_for(0.5)  # the change of subscribers is not measured
        before = node.cpu_seconds
        self.spin_for(seconds)
        share = (node.cpu_seconds - before) / seconds
        if subscription is not None:
            self.destroy_subscription(subscription)
            self.spin_until(lambda: not self.count_subscribers('/cloth/markers'))
        return share


def row(size: int, seconds: float) -> list[str]:
    """Return the row of a sheet with so many particles along each edge."""
    settings = {'sheet.rows': size, 'sheet.columns': size}
    command = [*NODE, '--ros-args']
    for name, value in settings.items():
        command += ['-p', f'{name}:={value}']
    with free_domain() as domain, probing(domain, MarkerListener) as listener:
        node = Process(command, environment(domain))
        try:
            # A node whose kernels are not compiled yet publishes a cloth that does not move.
            listener.spin_until(lambda: listener.reports and listener.reports[-1].simulated > 1)
            shares = [
                [listener.measure(node, seconds, subscribed) for subscribed in (False, True)]
                for _ in range(_REPEATS)
            ]
        finally:
            node.end()
    rate = Scene().markers.rate
    largest = max(listener.sizes)
    extra = float(np.median(np.diff(shares, axis=1)))
    return [
        f'{size} × {size}',
        f'{2 * (size - 1) ** 2}',
        f'{1e-6 * largest:.3g} MB',
        f'{1e-6 * largest * rate:.3g} MB/s',
        f'{100 * extra:.1f} %',
    ]


def main() -> None:
    """Measure all sizes, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=10.0, help='of each measurement')
    parser.add_argument('--page', type=Path, default=Path('docs/topics.md'))
    arguments = parser.parse_args()
    heads = ['sheet', 'triangles', 'message', 'at 30 Hz', 'processor time of the node']
    rows = [row(size, arguments.seconds) for size in _SIZES]
    machine = ', '.join(f'{name} {value}' for name, value in describe().items())
    text = f'{table(heads, rows)}\n\nShares of one core. Measured on: {machine}.'
    fill(arguments.page, _NAME, text)
    print(text)


if __name__ == '__main__':
    main()
