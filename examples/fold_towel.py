"""
Fold the towel of config/towel.yaml in half, and in half again, with two grippers.

    make run SCENE=config/towel.yaml
    python examples/fold_towel.py

The towel is reset first.  Where its corners are is read from the particles, as from a camera.
"""

import argparse
import math
import signal
import sys
import threading
import time
from collections.abc import Callable

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger

GRIPPERS = ('left', 'right')
APPROACH, FOLD, SETTLE = 1.0, 4.0, 1.5  # s
LAYER = 0.004  # m, by which a fold ends above the layers below
HEIGHT = 0.7  # of the path of a fold, as a share of a half circle
_RATE = 60.0  # Hz, of the states
_LONGEST = 10.0  # s, until the cloth is discovered


def smooth(share: float) -> float:
    """Return the share of a path after a share of the time: at rest at both ends."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def fold_pose(
    corner: np.ndarray, line: np.ndarray, axis: np.ndarray, share: float, height: float
) -> PoseStamped:
    """
    Return the pose of a gripper that folds a corner over a line.

    Parameters
    ----------
    corner, line, axis
        Where the corner is taken, the nearest point of the line, m, and its unit direction, all
        in the plane of the table; shape (3,).
    share
        Of the way, 0 to 1.
    height
        Of the corner above the table at the end, m.

    """
    angle = math.pi * share
    arm = corner - line
    length = float(np.linalg.norm(arm[:2]))
    along = arm / length
    place = line + length * math.cos(angle) * along
    place[2] = corner[2] + (height - corner[2]) * share + HEIGHT * length * math.sin(angle)
    half = angle / 2
    turn = (*(math.sin(half) * axis), math.cos(half))
    return pose_message(place, turn)


def pose_message(place: np.ndarray, turn: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)) -> PoseStamped:
    """Return a command; its empty frame is that of the cloth."""
    message = PoseStamped()
    position, orientation = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = map(float, place)
    orientation.x, orientation.y, orientation.z, orientation.w = map(float, turn)
    return message


class Folder(Node):
    """Moves the grippers, and reads where the towel is."""

    def __init__(self, stopped: threading.Event) -> None:
        super().__init__('fold_towel')
        self._stopped = stopped
        self._cloud: PointCloud2 | None = None
        self.create_subscription(PointCloud2, 'cloth/particles', self._receive, 1)
        self._factor, self._state = 0.0, ''
        self.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 1)
        self._poses = {
            name: self.create_publisher(PoseStamped, f'{name}/pose', 5) for name in GRIPPERS
        }
        self._grasps = {name: self.create_client(SetBool, f'{name}/grasp') for name in GRIPPERS}
        self._reset = self.create_client(Trigger, 'cloth/reset')
        self._places: dict[str, np.ndarray] = {}  # of the grippers, as commanded

    def _receive(self, message: PointCloud2) -> None:
        self._cloud = message

    def _diagnose(self, message: DiagnosticArray) -> None:
        status = message.status[0]
        values = {each.key: each.value for each in status.values}
        self._state, self._factor = status.message, float(values.get('real-time factor', 0.0))

    def connect(self) -> None:
        """Wait for the node and its grippers; end with a message if there are none."""
        for client in (self._reset, *self._grasps.values()):
            if not client.wait_for_service(_LONGEST):
                raise SystemExit('no towel found; run config/towel.yaml on this domain')
        end = time.monotonic() + _LONGEST
        while not all(each.get_subscription_count() for each in self._poses.values()):
            if time.monotonic() > end:
                raise SystemExit('the grippers do not listen; is another program in the way?')
            rclpy.spin_once(self, timeout_sec=0.02)
        said = ''
        while not self._factor > 0:  # at the first start, its kernels are being compiled
            if self._stopped.is_set():
                raise SystemExit(0)
            if said != self._state:
                said = self._state
                print(f'waiting: {said}', flush=True)
            rclpy.spin_once(self, timeout_sec=0.1)

    def call(self, client: rclpy.client.Client, request: object) -> object:
        """Return the answer of a service."""
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=_LONGEST)
        if future.result() is None:
            raise SystemExit(f'{client.srv_name} does not answer')
        return future.result()

    def reset(self) -> None:
        """Return the towel to its initial state, flat on the table."""
        self._places.clear()
        self.call(self._reset, Trigger.Request())

    def next_state(self) -> np.ndarray:
        """Wait for the next positions, m, shape (rows, columns, 3)."""
        self._cloud = None
        end = time.monotonic() + _LONGEST
        while self._cloud is None:
            if self._stopped.is_set():
                raise SystemExit(0)
            if time.monotonic() > end:
                raise SystemExit('no particles come; is the cloth paused?')
            rclpy.spin_once(self, timeout_sec=0.05)
        cloud = self._cloud
        values = np.frombuffer(cloud.data, np.float32)
        grid = values.reshape(cloud.height, cloud.width, cloud.point_step // 4)
        return grid[..., :3].astype(float)

    def wait(self, seconds: float) -> None:
        """Let some states pass; with a machine that is too slow, that takes longer."""
        for _ in range(round(seconds * _RATE)):
            self.next_state()

    def _follow(self, seconds: float, poses: Callable[[float], dict[str, PoseStamped]]) -> None:
        """Publish poses, a function of the share of the path, one after each state."""
        count = round(seconds * _RATE)
        for n in range(count):
            self.next_state()
            for name, message in poses(smooth((n + 1) / count)).items():
                self._poses[name].publish(message)
                place = message.pose.position
                self._places[name] = np.array((place.x, place.y, place.z))

    def approach(self, corners: dict[str, np.ndarray]) -> None:
        """Move the open grippers to corners, by way of a point above them."""
        above = np.array((0.0, 0.0, 0.1))
        start = {name: self._places.get(name, corner + above) for name, corner in corners.items()}

        def poses(share: float) -> dict[str, PoseStamped]:
            lift = np.array((0.0, 0.0, 0.1 * math.sin(math.pi * share)))
            return {
                name: pose_message((1 - share) * start[name] + share * corner + lift)
                for name, corner in corners.items()
            }

        self._follow(APPROACH, poses)

    def fold(
        self, corners: dict[str, np.ndarray], line: np.ndarray, axis: np.ndarray, layers: int
    ) -> None:
        """Take two corners, and lay them over a line onto the other half."""
        self.approach(corners)
        self.wait(0.1)
        for client in self._grasps.values():
            answer = self.call(client, SetBool.Request(data=True))
            print(answer.message, flush=True)
            if not answer.success:
                raise SystemExit(1)
        height = (2 * layers - 1) * LAYER

        def poses(share: float) -> dict[str, PoseStamped]:
            return {
                name: fold_pose(corner, line_point(corner, line, axis), axis, share, height)
                for name, corner in corners.items()
            }

        self._follow(FOLD, poses)
        self.wait(0.3)
        for client in self._grasps.values():
            self.call(client, SetBool.Request(data=False))
        end = {name: place + np.array((0.0, 0.0, 0.1)) for name, place in self._places.items()}
        self.approach(end)
        self.wait(SETTLE)


def line_point(corner: np.ndarray, line: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the point of a line, in the plane of the table, that is nearest to a corner."""
    point = line + float((corner - line) @ axis) * axis
    point[2] = 0.0
    return point


def fold_twice(folder: Folder) -> None:
    """Fold the far half onto the near one, and the left half of that onto the right one."""
    places = folder.next_state()
    line = places[places.shape[0] // 2].mean(axis=0)
    corners = {'left': places[-1, 0], 'right': places[-1, -1]}
    folder.fold(corners, line, np.array((1.0, 0.0, 0.0)), layers=1)
    places = folder.next_state()
    line = places[:, places.shape[1] // 2].mean(axis=0)
    open_corner = 0.5 * (places[0, 0] + places[-1, 0])
    fold_corner = places[places.shape[0] // 2, 0]
    corners = {'left': fold_corner, 'right': open_corner}
    folder.fold(corners, line, np.array((0.0, 1.0, 0.0)), layers=2)


def main() -> None:
    """Fold the towel, until Ctrl-C."""
    parser = argparse.ArgumentParser(
        description='Fold the towel of config/towel.yaml in half, and in half again.',
        epilog='example: fold_towel.py --times 3, each from the start',
    )
    parser.add_argument('--times', type=int, default=1, help='how often (default: once)')
    options = parser.parse_args(remove_ros_args(sys.argv)[1:])
    # A flag, as in watch.py: an exception within rclpy would now and then be reported as an error.
    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    folder = Folder(stopped)
    try:
        folder.connect()
        for _ in range(options.times):
            folder.reset()
            fold_twice(folder)
    finally:
        rclpy.shutdown()


if __name__ == '__main__':
    main()
