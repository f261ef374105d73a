"""Topics with the poses of colliders: `sphere_pose`, and `NAME/pose` of any other collider."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from geometry_msgs.msg import PoseStamped

from ..context import Context
from .subscription import subscribe

# Topics that are there even while the scene has no such collider: it can be added at any time.
_TOPICS = {'sphere': 'sphere_pose'}


def subscribe_to_collider_poses(context: Context) -> Iterable[str]:
    """Move every collider of the cloth by a topic of its own."""
    names = dict.fromkeys((*_TOPICS, *context.live.colliders))
    return [
        subscribe(context, PoseStamped, _TOPICS.get(name, f'{name}/pose'), _handler(context, name))
        for name in names
    ]


def _handler(context: Context, name: str) -> Callable[[PoseStamped], None]:
    def handle(message: PoseStamped) -> None:
        position = message.pose.position
        point = (position.x, position.y, position.z)
        frame = message.header.frame_id
        context.live.move_collider(name, context.transforms.to_own(point, frame, is_point=True))

    return handle
