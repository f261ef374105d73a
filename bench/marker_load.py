"""
Load of the markers by size of the sheet: bytes, rate, and time that the node needs for a message.

    python -m bench.marker_load [--seconds 8] [--page docs/howto/viewers.md]

For each size, starts a node with the default scene and subscribes to its markers as a recorder
does, without deserialising them, and to nothing else but its diagnostics.  Writes the table into
the page.  The time is what the node reports each second, the 99th percentile of its ticks; of
these values the smallest is taken, the one with the least disturbance by other processes.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from visualization_msgs.msg import MarkerArray

from cloth_ros import Scene
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line
from tools.marked_block import fill

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from ros import NODE, Probe, Process, environment, free_domain, probing

_SIZES = (32, 64, 128)
_NAME = 'python -m bench.marker_load'


class MarkerListener(Probe):
    """Subscribe to markers and diagnostics."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.sizes: list[int] = []  # bytes
        self.reports: list[dict[str, str]] = []
        self.create_subscription(MarkerArray, '/cloth/markers', self._note, 5, raw=True)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._report, 5)

    def _note(self, data: bytes) -> None:
        self.sizes.append(len(data))

    def _report(self, message: DiagnosticArray) -> None:
        (status,) = message.status
        self.reports.append({value.key: value.value for value in status.values})


def row(size: int, seconds: float) -> list[str]:
    """Return the row of a sheet with so many particles along each edge."""
    command = [*NODE, '--ros-args']
    for name in ('sheet.rows', 'sheet.columns'):
        command += ['-p', f'{name}:={size}']
    with free_domain() as domain, probing(domain, MarkerListener) as listener:
        node = Process(command, environment(domain))
        try:
            # A node whose kernels are not compiled yet publishes a cloth that does not move.
            listener.spin_until(
                lambda: listener.reports and float(listener.reports[-1]['simulated time [s]']) > 1
            )
            listener.reports.clear()
            listener.sizes.clear()
            listener.spin_for(seconds)
        finally:
            node.end()
    rate, largest = Scene().markers.rate, max(listener.sizes)
    times = [float(each['messages, 99th percentile [s]']) for each in listener.reports]
    return [
        f'{size} × {size}',
        f'{2 * (size - 1) ** 2}',
        f'{1e-6 * largest:.3g} MB',
        f'{1e-6 * largest * rate:.3g} MB/s',
        f'{1e3 * min(times):.2g} ms',
        f'{100 * min(times) * rate:.2g} %',
    ]


def main() -> None:
    """Measure all sizes, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=8.0, help='of each size')
    parser.add_argument('--page', type=Path, default=Path('docs/howto/viewers.md'))
    arguments = parser.parse_args()
    heads = [
        'sheet',
        'triangles',
        'message',
        f'at {Scene().markers.rate:g} Hz',
        'to build and publish it',
        'share of a core',
    ]
    rows = [row(size, arguments.seconds) for size in _SIZES]
    machine = describe_in_a_line()
    text = f'{table(heads, rows)}\n\nMeasured on: {machine}.'
    fill(arguments.page, _NAME, text)
    print(text)


if __name__ == '__main__':
    main()
