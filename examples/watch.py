"""
Print one line per second about the particles that a running cloth publishes, until Ctrl-C.

    python examples/watch.py
"""

import argparse
import signal
import sys
import threading
import time

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import PointCloud2


class Watch(Node):
    """Read the particles as an array and print their extent and speed."""

    def __init__(self) -> None:
        super().__init__('cloth_watch')
        self._count, self._since = 0, time.monotonic()
        self.create_subscription(PointCloud2, 'cloth/particles', self._on_particles, 5)
        print('waiting for cloth/particles')

    def _on_particles(self, message: PointCloud2) -> None:
        self._count += 1
        seconds = time.monotonic() - self._since
        if seconds < 1.0:
            return
        # Organised: one row of the array is one row of the sheet; x y z vx vy vz of each, or
        # x y z with particles.velocities: false.
        numbers = np.frombuffer(message.data, np.float32)
        particles = numbers.reshape(message.height, message.width, -1)
        low, high = particles[..., :3].min((0, 1)), particles[..., :3].max((0, 1))
        fastest = 'not published'
        if particles.shape[-1] == 6:
            fastest = f'{np.linalg.norm(particles[..., 3:], axis=-1).max():5.2f} m/s'
        extent = '  '.join(
            f'{name} {a:6.2f} to {b:5.2f}' for name, a, b in zip('xyz', low, high, strict=True)
        )
        print(f'{self._count / seconds:5.1f} Hz   {extent} m   fastest {fastest}')
        self._count, self._since = 0, time.monotonic()


def main() -> None:
    """Watch until Ctrl-C."""
    parser = argparse.ArgumentParser(
        description='Print one line per second about the particles of a cloth, until Ctrl-C.',
        epilog='example, for a cloth in a namespace: watch.py --ros-args -r __ns:=/lab',
    )
    parser.parse_args(remove_ros_args(sys.argv)[1:])
    # The handler only sets a flag: an exception raised within rclpy, or a context that ends during
    # one of its calls, would now and then be reported as an error.
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    executor = SingleThreadedExecutor()
    executor.add_node(Watch())
    while not stopped.is_set():
        executor.spin_once(timeout_sec=0.25)
    rclpy.shutdown()


if __name__ == '__main__':
    main()
