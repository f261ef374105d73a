"""
Other participants on the graph of a node, each in a process of its own: `python peers.py ROLE …`.

    subscribe        until it is ended
    crowd 100 10     so many participants that come and go, so many of them at once
    flood 2000 10    commands of wind and sphere, so many of each a second, for 10 s
    burn             keep a core busy
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rclpy.duration import Duration
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, str(Path(__file__).parents[1]))
from ros import pose, probing, wind

PEER = (sys.executable, __file__)
DEPTH = 5  # of the queues, as RViz has them
LAST = -4.0  # m, height at which a flood leaves the sphere
DOMAIN = int(os.environ.get('ROS_DOMAIN_ID', '0'))


Receive = Callable[[float], None]


@contextmanager
def subscriber() -> Iterator[Receive]:
    """Subscribe as RViz does; what is returned spins until there were so many messages."""
    with probing(DOMAIN) as probe:
        received = 0  # the messages are not kept: they are hundreds of megabytes a minute

        def take(_: bytes) -> None:
            nonlocal received
            received += 1

        for kind, topic in ((PointCloud2, 'particles'), (MarkerArray, 'markers')):
            probe.create_subscription(kind, f'/cloth/{topic}', take, DEPTH, raw=True)
        yield lambda count: probe.spin_until(lambda: received >= count, float('inf'))


def subscribe() -> None:
    """Subscribe until the process is ended."""
    with subscriber() as receive:
        receive(1)
        print('begin', flush=True)
        receive(float('inf'))


def crowd(count: str, at_once: str) -> None:
    """Subscribe, receive and leave, many times; the last participants are killed."""
    print('begin', flush=True)
    present: deque[tuple[ExitStack, Receive]] = deque()
    for _ in range(int(count)):
        stack = ExitStack()
        present.append((stack, stack.enter_context(subscriber())))
        if len(present) > int(at_once):
            stack, receive = present.popleft()
            receive(1)
            stack.close()
    for _, receive in present:
        receive(1)
    print('all have received', flush=True)
    os.kill(os.getpid(), signal.SIGKILL)


def flood(rate: str, seconds: str) -> None:
    """Command wind and sphere at a high rate; calm air and the sphere at `LAST` in the end."""
    with probing(DOMAIN) as probe:
        publishers = (
            probe.publisher(Vector3Stamped, '/wind', DEPTH),
            probe.publisher(PoseStamped, '/sphere_pose', DEPTH),
        )
        print('begin', flush=True)
        start, sent = time.monotonic(), 0
        while (now := time.monotonic() - start) < float(seconds):
            if sent >= float(rate) * now:
                time.sleep(1e-4)
                continue
            commands = wind(y=2.0 * (-1) ** sent), pose(z=-5.0 - 1e-4 * (sent % 1000))
            for publisher, command in zip(publishers, commands, strict=True):
                publisher.publish(command)
            sent += 1
        for publisher, command in zip(publishers, (wind(), pose(z=LAST)), strict=True):
            publisher.publish(command)
            publisher.wait_for_all_acked(Duration(seconds=5))
        print(f'{sent / float(seconds):.0f} per second', flush=True)


def burn() -> None:
    """Keep a core busy."""
    print('begin', flush=True)
    while True:
        pass


if __name__ == '__main__':
    roles = {'subscribe': subscribe, 'crowd': crowd, 'flood': flood, 'burn': burn}
    roles[sys.argv[1]](*sys.argv[2:])
