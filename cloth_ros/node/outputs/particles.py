"""The topic `~/particles`: position and velocity of every particle, at each tick."""

from __future__ import annotations

from sensor_msgs.msg import PointCloud2

from ...messages.particles import ParticlesMessage
from ..context import Context
from ..publisher import TolerantPublisher


class ParticlesOutput:
    """Publish the particles."""

    def __init__(self, context: Context) -> None:
        scene = context.live.scene
        self._live = context.live
        self._publisher = TolerantPublisher(context, PointCloud2, '~/particles')
        self._message = ParticlesMessage(scene.sheet.rows, scene.sheet.columns, scene.frame_id)
        self.topic = self._publisher.topic

    def publish(self, now: float, stamp: int) -> None:
        """Publish the present state, stamped in ns, if there is a subscriber."""
        if self._publisher.wanted:
            times = divmod(stamp, 1_000_000_000)
            self._publisher.publish(self._message.serialise(self._live, *times))
