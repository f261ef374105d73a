"""
Other participants on the graph of a node, each in a process of its own.

    peers.py subscribe        until it is ended
    peers.py crowd 100 10     so many participants that come and go, so many of them at once
    peers.py flood 2000 10    commands of wind and sphere, so many of each a second, for 10 s
    peers.py burn             keep a core busy
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections import deque

import rclpy
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

PEER = (sys.executable, __file__)
DEPTH = 5  # of the queues, as RViz has them
LAST = -4.0  # m, height at which a flood leaves the sphere


class Subscriber:
    """A participant that subscribes reliably, as RViz does."""

    def __init__(self) -> None:
        self._context = Context()
        rclpy.init(context=self._context)
        self._node = Node('subscriber', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._received = 0
        for kind, topic in ((PointCloud2, 'particles'), (MarkerArray, 'markers')):
            self._node.create_subscription(kind, f'/cloth/{topic}', self._count, DEPTH, raw=True)

    def _count(self, _: bytes) -> None:
        self._received += 1

    def receive(self, count: float = 1) -> None:
        """Spin until so many messages have been received."""
        while self._received < count:
            self._executor.spin_once(timeout_sec=0.05)

    def leave(self) -> None:
        """Leave the graph in order."""
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


def subscribe() -> None:
    """Subscribe until the process is ended."""
    subscriber = Subscriber()
    subscriber.receive()
    print('subscribed', flush=True)
    subscriber.receive(float('inf'))


def crowd(count: str, at_once: str) -> None:
    """Subscribe, receive and leave, many times; the last participants are killed."""
    print('begin', flush=True)
    present: deque[Subscriber] = deque()
    for _ in range(int(count)):
        present.append(Subscriber())
        if len(present) > int(at_once):
            present[0].receive()
            present.popleft().leave()
    for each in present:
        each.receive()
    print('all have received', flush=True)
    os.kill(os.getpid(), signal.SIGKILL)


def flood(rate: str, seconds: str) -> None:
    """Command wind and sphere at a high rate; calm air and the sphere at `LAST` in the end."""
    rclpy.init()
    node = rclpy.create_node('flood')
    wind = node.create_publisher(Vector3Stamped, '/wind', DEPTH)
    sphere = node.create_publisher(PoseStamped, '/sphere_pose', DEPTH)
    while not (wind.get_subscription_count() and sphere.get_subscription_count()):
        time.sleep(0.01)
    velocity, place = Vector3Stamped(), PoseStamped()

    def send_last() -> None:
        velocity.vector.y, place.pose.position.z = 0.0, LAST
        for publisher, message in ((wind, velocity), (sphere, place)):
            publisher.publish(message)
            publisher.wait_for_all_acked(Duration(seconds=5))

    send_last()
    print('begin', flush=True)
    start, sent = time.monotonic(), 0
    while (now := time.monotonic() - start) < float(seconds):
        if sent >= float(rate) * now:
            time.sleep(1e-4)
            continue
        velocity.vector.y = 2.0 * (-1) ** sent
        place.pose.position.z = -5.0 - 1e-4 * (sent % 1000)
        wind.publish(velocity)
        sphere.publish(place)
        sent += 1
    send_last()
    print(f'{sent / float(seconds):.0f} per second', flush=True)
    rclpy.shutdown()


def burn() -> None:
    """Keep a core busy."""
    print('begin', flush=True)
    while True:
        pass


if __name__ == '__main__':
    roles = {'subscribe': subscribe, 'crowd': crowd, 'flood': flood, 'burn': burn}
    roles[sys.argv[1]](*sys.argv[2:])
