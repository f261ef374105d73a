"""
Move the arm of config/robot_arm.yaml through the cloth, until Ctrl-C.

    make run SCENE=config/robot_arm.yaml
    python examples/robot_arm.py

The cloth is reset first: the arm then is where the motion begins.
"""

import argparse
import math
import signal
import sys
import threading
import time

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from std_srvs.srv import Trigger

SHOULDER = (0.0, -0.55, 0.75)  # m
# Colliders from the shoulder on, and the distance from joint to joint, m: `length` in the scene.
LINKS = {'upper_arm': 0.40, 'forearm': 0.36, 'hand': 0.14}
PERIOD = 8.0  # s
_RATE = 60.0  # Hz
_LONGEST = 10.0  # s, until the cloth is discovered

Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]


def joint_angles(seconds: float) -> tuple[float, list[float]]:
    """Return the azimuth of the arm, and the angle of each link from the vertical, rad."""
    phase = 2 * math.pi * seconds / PERIOD
    azimuth = math.radians(90 - 80 * math.cos(phase))
    lean = 10 * (1 - math.cos(2 * phase))  # forwards where the cloth is
    return azimuth, [math.radians(lean + upright) for upright in (25, 85, 100)]


def link_poses(seconds: float) -> dict[str, Pose]:
    """
    Return the poses of the links by forward kinematics.

    Each is its centre, m, and the quaternion x y z w that turns z along the link: first by its
    angle from the vertical about y, then by the azimuth about z.
    """
    azimuth, inclinations = joint_angles(seconds)
    poses = {}
    joint = SHOULDER
    for (name, length), inclination in zip(LINKS.items(), inclinations, strict=True):
        across = math.sin(inclination)
        along = (
            across * math.cos(azimuth),
            across * math.sin(azimuth),
            math.cos(inclination),
        )
        centre = tuple(a + length / 2 * b for a, b in zip(joint, along, strict=True))
        joint = tuple(a + length * b for a, b in zip(joint, along, strict=True))
        s, c = math.sin(azimuth / 2), math.cos(azimuth / 2)
        sine, cosine = math.sin(inclination / 2), math.cos(inclination / 2)
        poses[name] = centre, (-s * sine, c * sine, s * cosine, c * cosine)
    return poses


def pose_message(pose: Pose) -> PoseStamped:
    """Return a command; its empty frame is that of the cloth."""
    (x, y, z), (qx, qy, qz, qw) = pose
    message = PoseStamped()
    place, turn = message.pose.position, message.pose.orientation
    place.x, place.y, place.z = x, y, z
    turn.x, turn.y, turn.z, turn.w = qx, qy, qz, qw
    return message


def reset(node: Node) -> None:
    """Return the cloth, and with it the arm, to the initial state."""
    client = node.create_client(Trigger, 'cloth/reset')
    if not client.wait_for_service(_LONGEST):
        raise SystemExit('no cloth found; is the node running on this domain?')
    future = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, future, timeout_sec=_LONGEST)


def main() -> None:
    """Move the arm until Ctrl-C."""
    parser = argparse.ArgumentParser(
        description='Move the arm of config/robot_arm.yaml, until Ctrl-C.',
        epilog='example: robot_arm.py --seconds 16, two sweeps',
    )
    parser.add_argument('--seconds', type=float, default=math.inf, help='how long (default: ever)')
    options = parser.parse_args(remove_ros_args(sys.argv)[1:])
    # A flag, as in watch.py: an exception within rclpy would now and then be reported as an error.
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node('robot_arm')
    publishers = {name: node.create_publisher(PoseStamped, f'{name}/pose', 5) for name in LINKS}
    reset(node)
    for name, publisher in publishers.items():
        end = time.monotonic() + _LONGEST
        while not publisher.get_subscription_count():
            if time.monotonic() > end:
                raise SystemExit(f'the cloth has no collider {name}; run config/robot_arm.yaml')
            time.sleep(0.02)
    began = time.monotonic()
    while not stopped.wait(1 / _RATE):
        seconds = time.monotonic() - began
        if seconds > options.seconds:
            break
        for name, pose in link_poses(seconds).items():
            publishers[name].publish(pose_message(pose))
    rclpy.shutdown()


if __name__ == '__main__':
    main()
