"""
What sits beside the node on its graph, each in a process of its own.

    python -m reliability.peers subscribe        until it is ended
    python -m reliability.peers crowd 100        so many participants that come and go
    python -m reliability.peers flood 2000 10    wind and sphere, so many a second each, for 10 s
    python -m reliability.peers burn             a core kept busy
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

# The command of a process, to which its role is added.
PEER = (sys.executable, '-m', 'reliability.peers')
DEPTH = 5  # that of RViz
_AT_ONCE = 10  # participants of a crowd that are there together


class Subscriber:
    """A participant that subscribes reliably, as RViz does."""

    def __init__(self) -> None:
        self._context = Context()
        rclpy.init(context=self._context)
        self._node = Node('subscriber', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._heard = 0
        for kind, topic in ((PointCloud2, 'particles'), (MarkerArray, 'markers')):
            self._node.create_subscription(kind, f'/cloth/{topic}', self._hear, DEPTH, raw=True)

    def _hear(self, _: bytes) -> None:
        self._heard += 1

    def hear(self) -> None:
        """Listen until there is a message."""
        while not self._heard:
            self._executor.spin_once(timeout_sec=0.05)

    def spin(self) -> None:
        """Listen until the process is ended."""
        while True:
            self._executor.spin_once()

    def leave(self) -> None:
        """Say goodbye and go."""
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


def subscribe() -> None:
    """Listen until the process is ended."""
    subscriber = Subscriber()
    subscriber.hear()
    print('subscribed', flush=True)
    subscriber.spin()


def crowd(count: str) -> None:
    """Have subscribers come and go; the last of them go without a goodbye."""
    present: deque[Subscriber] = deque()
    for _ in range(int(count)):
        present.append(Subscriber())
        if len(present) > _AT_ONCE:
            oldest = present.popleft()
            oldest.hear()
            oldest.leave()
    for each in present:
        each.hear()
    print('all were here', flush=True)
    os.kill(os.getpid(), signal.SIGKILL)


def flood(rate: str, seconds: str) -> None:
    """Command wind and sphere as often as asked, and then calm air and the sphere's last place."""
    rclpy.init()
    node = rclpy.create_node('flood')
    wind = node.create_publisher(Vector3Stamped, '/wind', DEPTH)
    sphere = node.create_publisher(PoseStamped, '/sphere_pose', DEPTH)
    while not (wind.get_subscription_count() and sphere.get_subscription_count()):
        time.sleep(0.01)
    breeze, place = Vector3Stamped(), PoseStamped()

    def calm() -> None:
        breeze.vector.y, place.pose.position.z = 0.0, LAST
        for publisher, message in ((wind, breeze), (sphere, place)):
            publisher.publish(message)
            publisher.wait_for_all_acked(Duration(seconds=5))

    calm()
    print('heard', flush=True)
    start, sent = time.monotonic(), 0
    while (now := time.monotonic() - start) < float(seconds):
        if sent >= float(rate) * now:
            time.sleep(1e-4)
            continue
        breeze.vector.y = 2.0 * (-1) ** sent
        place.pose.position.z = -5.0 - 1e-4 * (sent % 1000)
        wind.publish(breeze)
        sphere.publish(place)
        sent += 1
    calm()
    print(f'{sent / float(seconds):.0f} a second', flush=True)
    rclpy.shutdown()


LAST = -4.0  # m, the height at which a flood leaves the sphere


def burn() -> None:
    """Keep a core busy."""
    print('burning', flush=True)
    while True:
        pass


if __name__ == '__main__':
    roles = {'subscribe': subscribe, 'crowd': crowd, 'flood': flood, 'burn': burn}
    roles[sys.argv[1]](*sys.argv[2:])
