"""The topics `NAME/wrench`: force and torque of the cloth on each collider and gripper."""

from __future__ import annotations

from geometry_msgs.msg import WrenchStamped

from ...messages.wrench import WrenchMessage
from ...scene import Scene
from ..context import Context
from ..publisher import TolerantPublisher


class WrenchesOutput:
    """
    Publish the wrench of every collider and gripper that has a subscriber, at each tick.

    The topics are those of the bodies that there are: one that is added gets its topic with the
    next state, and that of one that is removed disappears.
    """

    def __init__(self, context: Context) -> None:
        self._context, self._live = context, context.live
        self._message = WrenchMessage(context.live.scene.frame_id)
        self._publishers: dict[str, TolerantPublisher] = {}
        self._scene: Scene | None = None
        self._follow_scene()

    @property
    def topics(self) -> list[str]:
        """Full names of the topics."""
        return [publisher.topic for publisher in self._publishers.values()]

    def publish(self, now: float, stamp: int) -> None:
        """Publish the means of the last tick, stamped in ns, where there is a subscriber."""
        self._follow_scene()
        for name, publisher in self._publishers.items():
            if publisher.wanted:
                force, torque = self._live.bodies.wrench(name)
                times = divmod(stamp, 1_000_000_000)
                publisher.publish(self._message.serialise(force, torque, *times))

    def _follow_scene(self) -> None:
        """Make and destroy publishers, if the scene has changed."""
        if self._live.scene is self._scene:
            return
        self._scene = self._live.scene
        names = (*self._live.colliders, *self._live.grippers)
        for name in self._publishers.keys() - set(names):
            self._publishers.pop(name).destroy()
        for name in names:
            if name not in self._publishers:
                topic = f'{name}/wrench'
                self._publishers[name] = TolerantPublisher(self._context, WrenchStamped, topic)
