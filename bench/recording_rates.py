"""
Size and completeness of recordings by size of the sheet, in both storages of rosbag2.

    python -m bench.recording_rates [--seconds 10] [--page docs/howto/record.md]

For each size and storage, starts a node with the default scene, records its particles, ticks,
keyframes, scene and markers to a bag, and reads that back.  Messages that were lost are found by
the numbers of the ticks: there must be a record and a state for each, and markers must be as many
states apart as their rate says.  Sizes are those of the messages at their nominal rates,
which a machine that is busy with other work may not reach.  Writes the tables into the page.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rclpy.context import Context
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String, UInt8MultiArray
from visualization_msgs.msg import MarkerArray

from cloth_ros import Scene
from cloth_ros.live.keyframe import INTERVAL
from cloth_ros.live.tick_record import TickRecord, decode_record
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line
from tools.marked_block import fill

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))
from ros import NODE, Probe, Process, environment, free_domain, probing

_SIZES = (32, 64, 128)
_STORAGES = {'MCAP': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
_NAME = 'python -m bench.recording_rates'
_TOPICS: dict[str, type] = {
    'particles': PointCloud2,
    'markers': MarkerArray,
    'ticks': String,
    'keyframes': UInt8MultiArray,
    'scene': String,
}
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Recorder(Probe):
    """Write the topics of a cloth to a bag, as they come, while there is one."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.bag: Writer | None = None
        self.ticks = 0
        self._newest: dict[str, bytes] = {}
        self._connections: dict[str, Any] = {}
        for name, kind in _TOPICS.items():
            profile = _LATCHED if name == 'scene' else 1000
            take = self._taker(name)
            self.create_subscription(kind, f'/cloth/{name}', take, profile, raw=True)

    def _taker(self, name: str) -> Any:
        def take(data: bytes) -> None:
            self.ticks += name == 'ticks'
            self._newest[name] = data
            if self.bag is not None:
                self.bag.write(self._connections[name], time.time_ns(), data)

        return take

    def begin(self, path: Path, storage: StoragePlugin) -> Writer:
        """Record to a new bag from now on, and return it."""
        bag = Writer(path, version=9, storage_plugin=storage)
        bag.open()
        types = get_typestore(Stores.ROS2_JAZZY)
        for name, kind in _TOPICS.items():
            full = f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
            connection = bag.add_connection(f'/cloth/{name}', full, typestore=types)
            self._connections[name] = connection
        for name in ('keyframes', 'scene'):  # which are rare
            bag.write(self._connections[name], time.time_ns(), self._newest[name])
        self.bag = bag
        return bag


class Recording(NamedTuple):
    """
    What a bag has.

    Attributes
    ----------
    seconds
        From the first tick to the last.
    recorded, lost
        Messages by topic.
    sizes
        Mean size of a message by topic, MB.
    overhead
        Size of the whole bag as a multiple of that of its messages.

    """

    seconds: float
    recorded: Counter[str]
    lost: dict[str, int]
    sizes: dict[str, float]
    overhead: float


def record(size: int, storage: str, seconds: float) -> Recording:
    """Record a node with so many particles along each edge, and read that back."""
    command = [*NODE, '--ros-args']
    for name in ('sheet.rows', 'sheet.columns'):
        command += ['-p', f'{name}:={size}']
    folder = Path(tempfile.mkdtemp())
    try:
        with free_domain() as domain, probing(domain, Recorder) as recorder:
            node = Process(command, environment(domain))
            try:
                recorder.spin_until(lambda: recorder.ticks > 120)  # kernels are compiled
                bag = recorder.begin(folder / 'bag', _STORAGES[storage])
                end = time.monotonic() + seconds
                # Not `spin_for`: with a timeout that changes, rclpy serves the first subscription
                # before all others, which then lose messages while there is too much to do.
                recorder.spin_until(lambda: time.monotonic() > end)
                recorder.bag = None
                bag.close()
            finally:
                node.end()
        return read(folder / 'bag')
    finally:
        shutil.rmtree(folder)


def _stamp(message: Any) -> int:
    each = message.markers[0] if hasattr(message, 'markers') else message
    return each.header.stamp.sec * 10**9 + each.header.stamp.nanosec


def read(path: Path) -> Recording:
    """Return what a bag has."""
    recorded: Counter[str] = Counter()
    total: Counter[str] = Counter()
    records: list[TickRecord] = []
    stamps: dict[str, list[int]] = {'particles': [], 'markers': []}
    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages():
            name = connection.topic.rpartition('/')[2]
            recorded[name] += 1
            total[name] += len(data)
            if name == 'ticks':
                records.append(decode_record(reader.deserialize(data, connection.msgtype).data))
            elif name in stamps:
                stamps[name].append(_stamp(reader.deserialize(data, connection.msgtype)))
    first, last = records[0], records[-1]
    count = last.tick - first.tick + 1
    lost = {'ticks': count - len(records)}
    within = {
        name: sorted({each for each in found if first.stamp <= each <= last.stamp})
        for name, found in stamps.items()
    }
    lost['particles'] = count - len(within['particles'])
    # Markers are so many states apart, and more only where some were lost.
    scene = Scene()
    apart = round(scene.rate / scene.markers.rate)
    states = sorted({each.stamp for each in records} | set(within['particles']))
    steps = np.diff(np.searchsorted(states, within['markers']))
    lost['markers'] = int(np.sum(np.maximum(steps // apart - 1, 0)))
    size = sum(file.stat().st_size for file in path.iterdir())
    seconds = 1e-9 * (last.stamp - first.stamp)
    sizes = {name: 1e-6 * total[name] / recorded[name] for name in recorded}
    return Recording(seconds, recorded, lost, sizes, size / sum(total.values()))


def rows_of(size: int, storage: str, found: Recording) -> tuple[list[str], list[str]]:
    """Return a row of the messages, and one of MB per minute."""
    sheet = f'{size} × {size}'
    counted = [
        f'{found.recorded[name]} / {found.lost[name]}'
        for name in ('ticks', 'particles', 'markers')
    ]
    scene = Scene()
    rates = {'particles': scene.rate, 'ticks': scene.rate, 'keyframes': 1 / INTERVAL}
    minute = {name: 60 * rate * found.overhead * found.sizes[name] for name, rate in rates.items()}
    markers = 60 * scene.markers.rate * found.overhead * found.sizes['markers']
    needed = sum(minute.values())
    megabytes = [minute['particles'], needed, markers, needed + markers]
    rate = found.recorded['ticks'] / found.seconds
    return (
        [sheet, storage, f'{found.seconds:.1f} s', f'{rate:.1f}', *counted],
        [sheet, storage, *(f'{each:.0f}' for each in megabytes)],
    )


def main() -> None:
    """Measure all sizes in both storages, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=10.0, help='of each recording')
    parser.add_argument('--sizes', type=int, nargs='+', default=_SIZES)
    parser.add_argument('--page', type=Path, default=Path('docs/howto/record.md'))
    arguments = parser.parse_args()
    counts, sizes = [], []
    for size in arguments.sizes:
        for storage in _STORAGES:
            row, other = rows_of(size, storage, record(size, storage, arguments.seconds))
            print(*row, '|', *other, flush=True)
            counts.append(row)
            sizes.append(other)
    heads = ['sheet', 'storage', 'recorded', 'ticks per second']
    heads += [f'{name}: recorded / lost' for name in ('ticks', 'particles', 'markers')]
    parts = ['particles', 'particles, ticks, keyframes', 'markers', 'all']
    size_heads = ['sheet', 'storage', *(f'{part}, MB per minute' for part in parts)]
    machine = describe_in_a_line()
    text = f'{table(size_heads, sizes)}\n\n{table(heads, counts)}\n\nMeasured on: {machine}.'
    fill(arguments.page, _NAME, text)
    print(text)


if __name__ == '__main__':
    main()
