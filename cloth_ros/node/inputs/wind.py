"""The topic `wind`: velocity of the air, until the next message."""

from __future__ import annotations

from collections.abc import Iterable

from geometry_msgs.msg import Vector3Stamped

from ..context import Context
from ..rejected_inputs import THROTTLE
from .subscription import subscribe


def subscribe_to_wind(context: Context) -> Iterable[str]:
    """Set the wind of the cloth by topic."""
    log = context.node.get_logger()

    def handle(message: Vector3Stamped) -> None:
        vector = (message.vector.x, message.vector.y, message.vector.z)
        frame = message.header.frame_id
        context.live.set_wind(context.transforms.to_own(vector, frame, is_point=False))
        if not context.live.scene.has_air:
            log.warning(
                'the wind has no effect without air: set wind.air_density above 0, and give the '
                'sheet at least two rows and two columns',
                **THROTTLE,
            )

    return (subscribe(context, Vector3Stamped, 'wind', handle),)
