"""
Command a running cloth: wind, colliders, pause, steps, reset, save and load.

    python examples/command.py --wind 0 3 0
    python examples/command.py --from 0 -0.6 1.2 --sphere 0 0.4 1.2 --over 2
    python examples/command.py --collider box 0 0 0.6 --orientation 0 0 0.7 0.7
    python examples/command.py --pause --step 10 --save
"""

import argparse
import re
import sys
import time

import rclpy
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from std_srvs.srv import SetBool, Trigger

_LONGEST = 10.0  # s, until the cloth is discovered


def wait_until(condition, what: str) -> None:
    """Wait for discovery; exit with one line if it takes too long."""
    end = time.monotonic() + _LONGEST
    while not condition():
        if time.monotonic() > end:
            raise SystemExit(f'no cloth found on {what}; is the node running on this domain?')
        time.sleep(0.02)


def blow(node: Node, wind: list[float]) -> None:
    """Set the velocity of the air."""
    publisher = node.create_publisher(Vector3Stamped, 'wind', 1)
    wait_until(publisher.get_subscription_count, 'wind')
    message = Vector3Stamped()
    message.vector.x, message.vector.y, message.vector.z = wind
    publisher.publish(message)
    publisher.wait_for_all_acked()


def move(
    node: Node,
    topic: str,
    start: list[float] | None,
    end: list[float],
    seconds: float,
    orientation: list[float],
) -> None:
    """Move a collider to `end`: at once, or in a straight line from `start`."""
    publisher = node.create_publisher(PoseStamped, topic, 1)
    wait_until(publisher.get_subscription_count, topic)
    began, share = time.monotonic(), 0.0
    while share < 1.0:
        share = min((time.monotonic() - began) / seconds, 1.0) if start else 1.0
        message = PoseStamped()
        point = [a + share * (b - a) for a, b in zip(start or end, end, strict=True)]
        position = message.pose.position
        position.x, position.y, position.z = point
        turn = message.pose.orientation
        turn.x, turn.y, turn.z, turn.w = orientation
        publisher.publish(message)
        time.sleep(1 / 60)
    publisher.wait_for_all_acked()


def call(node: Node, kind: type, name: str, request) -> None:
    """Call a service and print its answer; exit with that if the service fails."""
    client = node.create_client(kind, name)
    wait_until(client.service_is_ready, name)
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future)
    if not future.result().success:
        raise SystemExit(future.result().message)
    print(future.result().message)


def main() -> None:
    """Send what the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__.strip().splitlines()[0],
        epilog='example: command.py --from 0 -0.6 1.2 --sphere 0 0.4 1.2 --over 2; for a cloth in '
        'a namespace: command.py --wind 0 3 0 --ros-args -r __ns:=/lab',
    )
    # Python 3.11 takes -1e-1 for an option.
    parser._negative_number_matcher = re.compile(r'-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$')
    xyz = {'nargs': 3, 'type': float, 'metavar': ('X', 'Y', 'Z')}
    parser.add_argument('--wind', **xyz, help='velocity of the air, m/s')
    parser.add_argument('--sphere', **xyz, help='centre to move the sphere to, m')
    parser.add_argument(
        '--collider',
        nargs=4,
        metavar=('NAME', 'X', 'Y', 'Z'),
        help='collider, and where to move its origin to, m',
    )
    parser.add_argument(
        '--orientation',
        nargs=4,
        type=float,
        default=[0.0, 0.0, 0.0, 1.0],
        metavar=('X', 'Y', 'Z', 'W'),
        help='quaternion that the collider turns to (default: not rotated)',
    )
    parser.add_argument('--from', dest='start', **xyz, help='where sphere or collider start, m')
    parser.add_argument(
        '--over', type=float, default=1.0, help='s, for the path from there (default 1)'
    )
    parser.add_argument('--pause', action='store_true', help='stop the time of the cloth')
    parser.add_argument('--resume', action='store_true', help='let time pass again')
    parser.add_argument('--reset', action='store_true', help='back to the initial state')
    parser.add_argument('--load', action='store_true', help='back to the saved state')
    parser.add_argument('--step', type=int, metavar='N', help='simulate N ticks while paused')
    parser.add_argument('--save', action='store_true', help='save the state')
    options = parser.parse_args(remove_ros_args(sys.argv)[1:])
    commands = ('wind', 'sphere', 'collider', 'pause', 'resume', 'reset', 'load', 'step', 'save')
    if not any(getattr(options, command) for command in commands):
        parser.error(f'say what to do: --{", --".join(commands[:-1])} or --{commands[-1]}')
    if options.start and not (options.sphere or options.collider):
        parser.error('--from goes with --sphere or --collider')
    try:
        name, *place = options.collider or ('', 0, 0, 0)
        place = [float(text) for text in place]
    except ValueError:
        parser.error(f'--collider is {" ".join(options.collider)}, but must be NAME X Y Z')
    if not options.over > 0:
        parser.error(f'--over is {options.over:g}, but must be more than 0 s')

    rclpy.init()
    node = Node('cloth_command')
    if options.wind:
        blow(node, options.wind)
    motion = options.over, options.orientation
    if options.sphere:
        move(node, 'sphere_pose', options.start, options.sphere, *motion)
    if options.collider:
        move(node, f'{name}/pose', options.start, place, *motion)
    if options.pause or options.resume:
        call(node, SetBool, 'cloth/pause', SetBool.Request(data=options.pause))
    steps = ['step'] * (options.step or 0)
    for name in ('reset', 'load', *steps, 'save'):
        if getattr(options, name):
            call(node, Trigger, f'cloth/{name}', Trigger.Request())
    rclpy.shutdown()


if __name__ == '__main__':
    main()
