"""Which moments of the scenes the pictures show, from where, and what is commanded meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from pathlib import Path
from typing import NamedTuple

from geometry_msgs.msg import PoseStamped

from examples import fold_towel, robot_arm
from examples.fold_towel import State

CONFIG = Path(__file__).parents[2] / 'config'


class Action(NamedTuple):
    """
    What is commanded between two states.

    Attributes
    ----------
    targets
        By the topic of the collider or gripper.
    grasp
        True: all grippers close; False: they open.

    """

    targets: Mapping[str, PoseStamped]
    grasp: bool | None = None


# Yields an action after each state, and receives the next state, with its simulated time.
Motion = Callable[[State], Generator[Action, State, object]]


class View(NamedTuple):
    """
    Directions from the scene to camera and sun, and height of the ground.

    Attributes
    ----------
    azimuth
        Degrees about z, from x to y.
    elevation
        Degrees above the horizontal.
    sun
        Degrees from the camera to the sun about z; negative: at the left of the picture.
    ground
        Height, m; None: just below the scene.

    """

    azimuth: float = -60.0
    elevation: float = 18.0
    sun: float = -45.0
    ground: float | None = None


class Moment(NamedTuple):
    """
    A picture of a scene.

    Attributes
    ----------
    picture
        Name of its file, without the ending.
    seconds
        Simulated time, s.
    view
        Where the camera is.

    """

    picture: str
    seconds: float
    view: View


def _arm(seconds: float) -> dict[str, robot_arm.Pose]:
    """Return the links of the arm as examples/robot_arm.py moves them."""
    return {f'{name}/pose': pose for name, pose in robot_arm.link_poses(seconds).items()}


def _push(seconds: float) -> dict[str, robot_arm.Pose]:
    """Return the small sphere on its way from a height of 1.5 m down to 0.6 m at 20 m/s."""
    return {'sphere_pose': ((0.0, 0.0, max(1.5 - 20 * seconds, 0.6)), (0.0, 0.0, 0.0, 1.0))}


def _timed(poses: Callable[[float], Mapping[str, robot_arm.Pose]]) -> Motion:
    """Return a motion whose poses depend on the time alone, which is that of the next state."""

    def motion(state: State) -> Generator[Action, State, object]:
        before = 0.0
        while True:
            ahead = 2 * state.seconds - before
            targets = {topic: robot_arm.pose_message(pose) for topic, pose in poses(ahead).items()}
            before, state = state.seconds, (yield Action(targets))

    return motion


def _fold(state: State) -> Generator[Action, State, object]:
    """Fold the towel as examples/fold_towel.py does."""
    steps = fold_towel.fold_twice(state)
    command = next(steps)
    while True:
        targets = {
            f'{name}/pose': fold_towel.pose_message(place, command.turn)
            for name, place in command.places.items()
        }
        state = yield Action(targets, command.grasp)
        try:
            command = steps.send(state)
        except StopIteration:
            return


# Of a sheet that is turned upright about x, as in config/, the side along its normal.
_FRONT = View(azimuth=60, elevation=16, sun=45)
_HANGING = View(azimuth=58, elevation=14, sun=45, ground=0.35)

_TOWEL = View(azimuth=-55, elevation=32, ground=0.0)

# By the name of the scene; another scene of config/ is shown as `of_scene` says.
MOMENTS: dict[str, tuple[Moment, ...]] = {
    'hanging': (Moment('falling', 0.35, _HANGING), Moment('at_rest', 12.0, _HANGING)),
    'gust': (Moment('wind', 5.6, View(azimuth=42, elevation=12, sun=45)),),
    'drop_on_sphere': (Moment('sphere', 1.6, View(azimuth=-72, elevation=9)),),
    'small_fast_sphere': (Moment('small_fast_sphere', 1.0, View(azimuth=-62, elevation=42)),),
    'table': (Moment('table', 2.5, View(azimuth=-50, elevation=16, ground=0.0)),),
    'box': (Moment('box', 1.6, View(azimuth=-50, elevation=22, ground=0.15)),),
    'towel': (
        Moment('towel_first_fold', 3.6, _TOWEL),
        Moment('towel_second_fold', 11.6, _TOWEL),
        Moment('towel', 17.0, _TOWEL),
    ),
    'robot_arm': (Moment('robot_arm', 2.2, View(azimuth=-46, elevation=16, ground=0.0)),),
}
MOTIONS: dict[str, Motion] = {
    'robot_arm': _timed(_arm),
    'small_fast_sphere': _timed(_push),
    'towel': _fold,
}


class Animation(NamedTuple):
    """
    Moments of one scene in succession.

    Attributes
    ----------
    picture
        Name of its file, without the ending.
    scene
        Name of its scene.
    begin, end
        Simulated times, s.
    view
        Where the camera is.

    """

    picture: str
    scene: str
    begin: float
    end: float
    view: View


# The second sweep of the arm, which ends as it began: it can be repeated without a jump.
ANIMATION = Animation('arm', 'robot_arm', 8.0, 16.0, MOMENTS['robot_arm'][0].view)


def of_scene(path: Path) -> tuple[Moment, ...]:
    """Return the moments of a scene file; one that is not in the table is shown after 2 s."""
    return MOMENTS.get(path.stem, (Moment(path.stem, 2.0, _FRONT),))
