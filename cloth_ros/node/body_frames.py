"""
Colliders and grippers that follow a frame of tf2, at the time of each tick.

The parameters of such a body give its pose in that frame.  It is simulated from the first
transform on, in the pose of that time: the cloth is not struck by a collider that is only placed.
Where a transform is missing later, or too old, the body stays where it is.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Transform

from ..live.live_cloth import LiveCloth
from ..scene import Scene
from ..scene.named_group import NamedMember
from ..scene.parameter import one_line
from .rejected_inputs import THROTTLE
from .transforms import Pose, Transforms, transformed_pose

_LONGEST = 200  # characters of a reason in the diagnostics


class _Followed:
    """
    One body that follows a frame.

    Attributes
    ----------
    parameters
        Of the body, with its pose in the frame.
    start
        Pose in the scene that is simulated, where the body is after a reset; None before the
        first transform.
    commanded
        Pose of the last command; None: none since the state was replaced.
    problem
        Why it stays where it is; empty if it does not.

    """

    def __init__(self, parameters: NamedMember, start: Pose | None) -> None:
        self.parameters = parameters
        self.start = start
        self.commanded: Pose | None = None
        self.problem = ''


class BodyFrames:
    """
    Move colliders and grippers with frames of tf2.

    Parameters
    ----------
    transforms
        Of the node.
    log
        Logger of the node.

    """

    def __init__(self, transforms: Transforms, log: Any) -> None:
        self._transforms, self._log = transforms, log
        self._scene: Scene | None = None
        self._followed: dict[str, _Followed] = {}
        self._replaced = 0  # of the cloth, when poses were last commanded

    def followed_by(self, name: str) -> str:
        """Return the frame that a body follows; empty: none."""
        followed = self._followed.get(name)
        return followed.parameters.frame_id if followed else ''

    def parameter(self, name: str) -> str:
        """Return the name of the parameter with the frame that a body follows."""
        return self._followed[name].parameters.full_name('frame_id')

    def simulated(self, scene: Scene, live: LiveCloth | None, time: int) -> Scene:
        """
        Return a scene as it is simulated: with poses in its own frame.

        Bodies whose frame is not known yet, and parameters of bodies that are not named, are left
        out.

        Parameters
        ----------
        scene
            The parameters of the node.
        live
            The running cloth; None before the start.
        time
            Now, ns.

        """
        self._scene = scene
        former, self._followed = self._followed, {}
        for each in (*scene.colliders, *scene.grippers):
            if self._transforms.is_own(each.frame_id):
                continue
            known = former.get(each.name)
            if known is not None and _same_place(known.parameters, each):
                known.parameters = each
            else:
                known = _Followed(each, _present(live, each.name))
            self._followed[each.name] = known
        self._look_up(time)
        return self._placed(scene)

    def _placed(self, scene: Scene) -> Scene:
        """Return a scene with the bodies whose pose is known, and with those poses."""
        if not self._followed and not any(group.unnamed for group in scene.named_groups):
            return scene
        changes: dict[str, Any] = {}
        for group in scene.named_groups:
            changes[f'{group.prefix}names'] = [
                name
                for name in group.names
                if name not in self._followed or self._followed[name].start is not None
            ]
        for each in self._followed.values():
            if each.start is not None:
                position, orientation = each.start
                changes[each.parameters.full_name('position')] = position
                changes[each.parameters.full_name('orientation')] = orientation
        return scene.with_parameters(changes)

    def in_frames(self, scene: Scene) -> Scene:
        """Return a scene as it is simulated with the poses of bodies in their frames again."""
        changes: dict[str, Any] = {}
        present = {name for group in scene.named_groups for name in group.names}
        for name, each in self._followed.items():
            if name in present:
                known = each.parameters
                changes[known.full_name('position')] = known.position
                changes[known.full_name('orientation')] = known.orientation
        return scene.with_parameters(changes) if changes else scene

    def move(self, live: LiveCloth, time: int) -> None:
        """
        Command the poses at the time of a tick, ns; to be called before the tick.

        A body whose frame has become known is added to the cloth.
        """
        if not self._followed or self._scene is None:
            return
        if live.replaced != self._replaced:
            self._replaced = live.replaced
            for followed in self._followed.values():
                followed.commanded = None
        waiting = [each for each in self._followed.values() if each.start is None]
        poses = self._look_up(time)
        if any(each.start is not None for each in waiting):
            live.configure(self._placed(self._scene))
        for name, pose in poses.items():
            each = self._followed[name]
            if pose == each.commanded or live.bodies.pose(name) is None:
                continue
            try:
                live.bodies.move(name, *pose)
            except ValueError as error:
                self._report(name, each, str(error))
            else:
                each.commanded = pose

    def prepare_reset(self, live: LiveCloth, time: int) -> None:
        """Let a reset, which follows, place the bodies where their frames are now."""
        if not self._followed or self._scene is None:
            return
        for name, pose in self._look_up(time).items():
            self._followed[name].start = pose
        live.configure(self._placed(self._scene))

    @property
    def problem(self) -> str:
        """Which body stays where it is, and why; empty if all follow their frames."""
        problems = [_text(name, each) for name, each in self._followed.items() if each.problem]
        kinds = sorted({each.parameters.kind for each in self._followed.values() if each.problem})
        several = f'{len(problems)} {"s and ".join(kinds)}s: '
        return f'{several}{problems[0]}' if len(problems) > 1 else ''.join(problems)

    def values(self) -> dict[str, object]:
        """Return what each body follows, for the diagnostics."""
        followed = [(each.parameters, each.problem) for each in self._followed.values()]
        return {
            f'{known.kind} {known.name} follows': problem[:_LONGEST] or known.frame_id
            for known, problem in followed
        }

    def _look_up(self, time: int) -> dict[str, Pose]:
        """Return the poses at a time, ns, of the bodies whose frame is known then."""
        poses: dict[str, Pose] = {}
        frames: dict[str, Transform | str] = {}
        for name, each in self._followed.items():
            frame = each.parameters.frame_id
            if frame not in frames:
                try:
                    frames[frame] = self._transforms.frame_at(frame, time)
                except ValueError as error:
                    frames[frame] = str(error)
            found = frames[frame]
            if isinstance(found, str):
                self._report(name, each, found)
                continue
            known = each.parameters
            poses[name] = transformed_pose(known.position, known.orientation, found)
            if each.start is None:
                each.start = poses[name]
            self._report(name, each, '')
        return poses

    def _report(self, name: str, each: _Followed, problem: str) -> None:
        """Log when a body ceases to follow its frame, and when it follows it again."""
        former, each.problem = each.problem, one_line(problem)
        if bool(former) == bool(problem):
            return
        log = self._log.get_child(name)  # rclpy throttles by logger and line
        if problem:
            log.warning(_text(name, each), **THROTTLE)
        else:
            known = each.parameters
            log.info(f'the {known.kind} {name!r} follows {known.frame_id!r}', **THROTTLE)


def _text(name: str, each: _Followed) -> str:
    state = 'is not there yet' if each.start is None else 'stays where it is'
    return f'the {each.parameters.kind} {name!r} {state}: {each.problem}'


def _same_place(first: NamedMember, second: NamedMember) -> bool:
    """Return True if two bodies are at the same place of the same frame."""
    return (first.frame_id, first.position, first.orientation) == (
        second.frame_id,
        second.position,
        second.orientation,
    )


def _present(live: LiveCloth | None, name: str) -> Pose | None:
    """Return the present pose of a body in the frame of the scene, if it is there."""
    return None if live is None else live.bodies.pose(name)
