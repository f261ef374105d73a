"""Topics with poses: `sphere_pose`, and `NAME/pose` of each other collider and each gripper."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from geometry_msgs.msg import PoseStamped
from rclpy.subscription import Subscription

from ...scene import Scene
from ..context import Context
from .subscription import subscribe

# Topics that are there even while the scene has no such collider: it can be added at any time.
_TOPICS = {'sphere': 'sphere_pose'}


class BodyPoses:
    """Move every collider and gripper by a topic of its own, which comes and goes with it."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._scene: Scene | None = None
        self._subscriptions: dict[str, Subscription] = {}
        for name in _TOPICS:
            self._subscribe(name)

    @property
    def topics(self) -> list[str]:
        """Full names of the topics."""
        return [each.topic_name for each in self._subscriptions.values()]

    def follow(self, scene: Scene) -> None:
        """Subscribe to the poses of the bodies of a scene, and to no others."""
        former, self._scene = self._scene, scene
        names = (*_TOPICS, *(name for group in scene.named_groups for name in group.names))
        log = self._context.node.get_logger()
        for name in self._subscriptions.keys() - set(names):
            gone = self._subscriptions.pop(name)
            log.info(f'no longer listening to {gone.topic_name}')
            self._context.node.destroy_subscription(gone)
            self._context.rejected.unregister(_topic(name))
        for name in names:
            if name not in self._subscriptions:
                self._subscribe(name)
                if former is not None:
                    log.info(f'listening to {self._subscriptions[name].topic_name}')

    def _subscribe(self, name: str) -> None:
        handle: Callable[[PoseStamped], None] = partial(self._handle, name)
        self._subscriptions[name] = subscribe(self._context, PoseStamped, _topic(name), handle)

    def _handle(self, name: str, message: PoseStamped) -> None:
        frame = self._context.frames.followed_by(name)
        if frame:
            raise ValueError(
                f'{name!r} follows the frame {frame!r}; set '
                f'{self._context.frames.parameter(name)} to "" to move it by this topic'
            )
        point, turn = message.pose.position, message.pose.orientation
        position, orientation = self._context.transforms.pose_to_own(
            (point.x, point.y, point.z),
            (turn.x, turn.y, turn.z, turn.w),
            message.header.frame_id,
        )
        self._context.live.bodies.move(name, position, orientation)


def _topic(name: str) -> str:
    return _TOPICS.get(name, f'{name}/pose')
