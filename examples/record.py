"""
Record a running cloth to a bag (MCAP) until Ctrl-C, where `ros2 bag record` is not installed.

    python examples/record.py my_bag --seconds 10

`ros2 bag play` and Foxglove read the bag, `cloth_resimulate` repeats it, and the Python library
rosbags writes it here.
"""

import argparse
import functools
import math
import signal
import sys
import threading
import time
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.msg import ParameterEvent
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String, UInt8MultiArray

TOPICS = {
    'cloth/particles': PointCloud2,
    'cloth/ticks': String,
    'cloth/keyframes': UInt8MultiArray,
    'cloth/scene': String,
    'wind': Vector3Stamped,
    'sphere_pose': PoseStamped,
    '/diagnostics': DiagnosticArray,
    '/parameter_events': ParameterEvent,
}
# Of the scene, which was published before the recorder has begun.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Recorder(Node):
    """Write the messages of some topics to a bag, as they come."""

    def __init__(self, bag: Writer, topics: dict[str, type]) -> None:
        super().__init__('cloth_record')
        self.count, self.repeatable = 0, False
        self._bag = bag
        types = get_typestore(Stores.ROS2_JAZZY)
        for topic, kind in topics.items():
            package, name = kind.__module__.split('.')[0], kind.__name__
            connection = bag.add_connection(
                self.resolve_topic_name(topic), f'{package}/msg/{name}', typestore=types
            )
            write = functools.partial(self._write, connection)
            profile = LATCHED if topic == 'cloth/scene' else 1000
            self.create_subscription(kind, topic, write, profile, raw=True)

    def _write(self, connection: Connection, message: bytes) -> None:
        self._bag.write(connection, time.time_ns(), message)
        self.count += 1
        if not self.repeatable and connection.topic.endswith('/keyframes'):
            self.repeatable = True
            print('recording; from here on, cloth_resimulate can repeat it', flush=True)


def main() -> None:
    """Record until Ctrl-C, or for some seconds from the first message on."""
    parser = argparse.ArgumentParser(
        description='Record a running cloth to a bag, until Ctrl-C.',
        epilog='example: record.py my_bag --seconds 10 --poses box table',
    )
    parser.add_argument('bag', type=Path, help='folder to make')
    parser.add_argument('--seconds', type=float, default=math.inf, help='how long (default: ever)')
    parser.add_argument(
        '--poses', nargs='*', default=[], metavar='NAME', help='colliders whose commands to record'
    )
    options = parser.parse_args(remove_ros_args(sys.argv)[1:])
    if options.bag.exists():
        parser.error(f'{options.bag} exists already; give the name of a new folder')
    topics = TOPICS | {f'{name}/pose': PoseStamped for name in options.poses}
    # A flag, as in watch.py: an exception within rclpy would now and then be reported as an error.
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    with Writer(options.bag, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        recorder = Recorder(bag, topics)
        executor = SingleThreadedExecutor()
        executor.add_node(recorder)
        print(f'waiting for {recorder.resolve_topic_name("cloth/particles")}', flush=True)
        end = math.inf
        while not stopped.is_set() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.25)
            if recorder.count and end == math.inf:
                end = time.monotonic() + options.seconds
        end, before = time.monotonic() + 1.0, -1
        while recorder.count > before and time.monotonic() < end:  # what has arrived already
            before = recorder.count
            executor.spin_once(timeout_sec=0.1)
    print(f'{recorder.count} messages in {options.bag}')
    rclpy.shutdown()


if __name__ == '__main__':
    main()
