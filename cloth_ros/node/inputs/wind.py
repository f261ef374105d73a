"""The topic `wind`: velocity of the air, until the next message."""

from __future__ import annotations

from geometry_msgs.msg import Vector3Stamped

from ...scene import Scene
from ..context import Context
from ..rejected_inputs import THROTTLE
from .subscription import subscribe


class WindInput:
    """Set the wind of the cloth by topic."""

    def __init__(self, context: Context) -> None:
        self._live, self._transforms = context.live, context.transforms
        self._log = context.node.get_logger()
        self.topics = [subscribe(context, Vector3Stamped, 'wind', self._handle).topic_name]

    def follow(self, scene: Scene) -> None:
        """Do nothing: the topic is the same in every scene."""

    def _handle(self, message: Vector3Stamped) -> None:
        vector = (message.vector.x, message.vector.y, message.vector.z)
        frame = message.header.frame_id
        self._live.set_wind(self._transforms.to_own(vector, frame, is_point=False))
        if not self._live.scene.has_air:
            self._log.warning(
                'the wind has no effect without air: set wind.air_density above 0, and give the '
                'sheet at least two rows and two columns',
                **THROTTLE,
            )
