"""
Fold the towel of config/towel.yaml in half, and in half again, with two grippers.

    make run SCENE=config/towel.yaml
    python examples/fold_towel.py

The towel is reset first.  Where its corners are is read from the particles, as from a camera.  The
motion follows the time of the states.  In that scene the node publishes /clock, so that this is
simulated time: on a machine that is too slow, the motion takes longer and is otherwise the same.
"""

import argparse
import math
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Mapping
from typing import NamedTuple

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
APPROACH, FOLD, SETTLE = 1.0, 4.0, 2.0  # s
PAUSE = 0.2  # s, before a grasp and before a release
LAYER = 0.003  # m, distance of the layers that lie on each other
ABOVE = 0.1  # m, of open grippers above the towel
DROP = 0.008  # m, by which a fold ends above where it will lie: folds below stand up a little
# Height of the path of a fold over its line, as a share of half its width, and the exponent of its
# second half.  With 1 and 1, what is laid down hangs straight from the gripper and pulls at
# nothing; on a half circle it is stretched out, and drags the layers below along.
HEIGHT, EXPONENT = 0.8, 1.3
_LONGEST = 10.0  # s, until the cloth is discovered
_LONGEST_TICK = 300.0  # s, of a machine that is too slow

Array = np.ndarray
Quaternion = tuple[float, float, float, float]
_UPRIGHT = (0.0, 0.0, 0.0, 1.0)


class State(NamedTuple):
    """Time of a state, s, and positions of the particles, m, shape (rows, columns, 3)."""

    seconds: float
    positions: Array


class Command(NamedTuple):
    """
    What the grippers have to do next.

    Attributes
    ----------
    places
        Their targets, m, by name.
    turn
        Their orientation, x y z w.
    grasp
        True: take what is in reach; False: release it.

    """

    places: Mapping[str, Array]
    turn: Quaternion = _UPRIGHT
    grasp: bool | None = None


# Yields a command after each state, and receives the next state.
Motion = Generator[Command, State, State]


def smooth(share: float) -> float:
    """Return the share of a path after a share of the time: at rest at both ends."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def follow(state: State, seconds: float, path: Callable[[float], Command]) -> Motion:
    """Follow a path, a function of the share of it that is done, for so many seconds."""
    begin = state.seconds
    while True:
        share = (state.seconds - begin) / seconds
        state = yield path(smooth(share))
        if share >= 1:
            return state


def straight(
    state: State, seconds: float, start: Mapping[str, Array], end: Mapping[str, Array]
) -> Motion:
    """Move the grippers from places to others, in straight lines."""

    def path(share: float) -> Command:
        return Command({name: (1 - share) * start[name] + share * end[name] for name in end})

    return (yield from follow(state, seconds, path))


def fold_path(
    corners: Mapping[str, Array], line: Array, axis: Array, layers: int
) -> Callable[[float], Command]:
    """
    Return the path of grippers that lay corners over a line.

    Parameters
    ----------
    corners
        Where each gripper has taken the towel, m, shape (3,).
    line, axis
        A point of the line, m, and its unit direction, horizontal, shape (3,).
    layers
        Of the part that is laid over.

    """
    top = (2 * layers - 1) * LAYER

    def place(corner: Array, share: float) -> Array:
        foot = line + float((corner - line) @ axis) * axis
        arm = (corner - foot) * (1.0, 1.0, 0.0)
        across, up = math.cos(math.pi * share), math.sin(math.pi * share)
        result = foot + across * arm
        # Up first: what lies there would be pushed aside.
        rise = up if share < 0.5 else 1 - abs(across) ** EXPONENT
        result[2] = (1 - share) * corner[2] + share * (top - corner[2] + DROP)
        result[2] += HEIGHT * float(np.linalg.norm(arm)) * rise
        return result

    def path(share: float) -> Command:
        # Slow at both ends: what is held would turn into the table before it has risen.
        half = math.pi / 2 * share**2 * (3 - 2 * share)
        x, y, z = math.sin(half) * axis
        places = {name: place(corner, share) for name, corner in corners.items()}
        return Command(places, (float(x), float(y), float(z), math.cos(half)))

    return path


def fold(
    state: State, corners: Mapping[str, Array], line: Array, axis: Array, layers: int
) -> Motion:
    """Take two corners from above, lay them over a line onto the other half, and let go."""
    up = np.array((0.0, 0.0, ABOVE))
    above = {name: corner + up for name, corner in corners.items()}
    state = yield from straight(state, APPROACH, above, corners)
    state = yield from straight(state, PAUSE, corners, corners)
    state = yield Command(corners, grasp=True)
    path = fold_path(corners, line, axis, layers)
    state = yield from follow(state, FOLD, path)
    end = path(1.0)
    state = yield from follow(state, PAUSE, lambda _: end)
    state = yield end._replace(grasp=False)
    above = {name: place + up for name, place in end.places.items()}
    state = yield from straight(state, APPROACH, end.places, above)
    return (yield from straight(state, SETTLE, above, above))


def first_fold(state: State) -> Motion:
    """Fold the far half of the towel, of the last rows, onto the near one."""
    places = state.positions
    corners = {'left': places[-1, 0], 'right': places[-1, -1]}
    line = 0.5 * (places[0] + places[-1]).mean(axis=0)
    return (yield from fold(state, corners, line, np.array((1.0, 0.0, 0.0)), layers=1))


def second_fold(state: State) -> Motion:
    """Fold the left half of the folded towel, of the first columns, onto the right one."""
    places = state.positions
    middle = (places.shape[0] - 1) // 2
    corners = {'left': places[middle, 0], 'right': 0.5 * (places[0, 0] + places[-1, 0])}
    line = 0.5 * (places[:, 0] + places[:, -1]).mean(axis=0)
    return (yield from fold(state, corners, line, np.array((0.0, 1.0, 0.0)), layers=2))


def fold_twice(state: State) -> Motion:
    """Fold the towel in half, and in half again."""
    state = yield from first_fold(state)
    return (yield from second_fold(state))


def pose_message(place: Array, turn: Quaternion = _UPRIGHT) -> PoseStamped:
    """Return a command to a gripper; its empty frame is that of the cloth."""
    message = PoseStamped()
    position, orientation = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = map(float, place)
    orientation.x, orientation.y, orientation.z, orientation.w = turn
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

    def _call(self, client: rclpy.client.Client, request: object) -> object:
        """Return the answer of a service."""
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=_LONGEST_TICK)
        if future.result() is None:
            raise SystemExit(f'{client.srv_name} does not answer')
        return future.result()

    def reset(self) -> None:
        """Return the towel to its initial state, flat on the table."""
        self._call(self._reset, Trigger.Request())
        self.next_state()  # which may be from before

    def next_state(self) -> State:
        """Wait for the next state."""
        self._cloud = None
        end = time.monotonic() + _LONGEST_TICK
        while self._cloud is None:
            if self._stopped.is_set():
                raise SystemExit(0)
            if time.monotonic() > end:
                raise SystemExit('no particles come; is the cloth paused?')
            rclpy.spin_once(self, timeout_sec=0.05)
        cloud = self._cloud
        values = np.frombuffer(cloud.data, np.float32)
        grid = values.reshape(cloud.height, cloud.width, cloud.point_step // 4)
        stamp = cloud.header.stamp
        return State(stamp.sec + 1e-9 * stamp.nanosec, grid[..., :3].astype(float))

    def _grasp(self, data: bool) -> None:
        """Close or open both grippers; end with the reason if one finds nothing to take."""
        for client in self._grasps.values():
            answer = self._call(client, SetBool.Request(data=data))
            print(answer.message, flush=True)
            if not answer.success:
                raise SystemExit(1)

    def run(self, motion: Callable[[State], Motion]) -> None:
        """Command what a motion says, until its end."""
        state = self.next_state()
        steps = motion(state)
        command = next(steps)
        while True:
            for name, place in command.places.items():
                self._poses[name].publish(pose_message(place, command.turn))
            if command.grasp is not None:
                self._grasp(command.grasp)
            before, state = state, self.next_state()
            if state.seconds < before.seconds:
                raise SystemExit('the cloth was reset meanwhile')
            try:
                command = steps.send(state)
            except StopIteration:
                return


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
            folder.run(fold_twice)
    finally:
        rclpy.shutdown()


if __name__ == '__main__':
    main()
