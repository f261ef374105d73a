"""
What a recording needs: `~/ticks`, `~/keyframes` and `~/scene`.

`~/ticks` has a record of each tick: the inputs that it has taken in, and its step.  `~/keyframes`
has the exact state: for each new subscriber, after a state was restored, and now and then, so that
a replay can begin there, also behind a gap.  `~/scene` is the scene as it runs, a ROS parameter
file, which late subscribers receive as well.
"""

from __future__ import annotations

import array

from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String, UInt8MultiArray

from ...live import keyframe
from ...live.tick_record import RESTORED, TickRecord, scene_text
from ...scene import Scene
from ..context import Context
from ..publisher import TolerantPublisher

# Records are small, and each that a recorder loses is a gap: the queue is deep.
_DEPTH = 1000
_AGAIN = 1.0  # s of ticks, from the keyframe for a new subscriber to the next


class RecordingOutput:
    """Publish the record of each tick, keyframes and the scene, where there is a subscriber."""

    def __init__(self, context: Context) -> None:
        self._live = context.live
        many = QoSProfile(depth=_DEPTH)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._ticks = TolerantPublisher(context, String, '~/ticks', many)
        self._keyframes = TolerantPublisher(context, UInt8MultiArray, '~/keyframes')
        self._scenes = TolerantPublisher(context, String, '~/scene', latched)
        self._scene: Scene | None = None
        self._subscribers = (0, 0)
        self._published = (-1, 0)
        self._next = 0
        self._record = TickRecord(0, 0, 0, 0.0)  # of the last tick
        self.topics = (self._ticks.topic, self._keyframes.topic, self._scenes.topic)

    def publish(self, now: float, stamp: int) -> None:
        """Publish what the tick at `now`, s, has done, unless its state was published before."""
        self._publish_scene()
        subscribers, former = self._subscribers_now(), self._subscribers
        self._subscribers = subscribers
        appeared = any(new > old for new, old in zip(subscribers, former, strict=True))
        state, restored = (self._live.revision, stamp), False
        # Of a paused cloth only what was changed.
        if state != self._published or self._live.record.changed:
            self._published = state
            record = self._record = self._live.record.take(
                stamp, round(1e9 * now), self._live.time
            )
            restored = any(change.kind == RESTORED for change in record.changes)
            if any(subscribers):
                self._ticks.publish(String(data=record.encode()))
        if any(subscribers) and (appeared or restored or self._record.tick >= self._next):
            # A subscriber that knows of the publisher later than that of it may miss the first.
            self._publish_keyframe(_AGAIN if appeared else keyframe.INTERVAL)

    def _subscribers_now(self) -> tuple[int, int]:
        return self._ticks.subscribers, self._keyframes.subscribers

    def _publish_keyframe(self, interval: float) -> None:
        record = self._record
        self._next = record.tick + round(interval * self._live.scene.rate)
        if self._keyframes.wanted:
            data = self._live.keyframe(record.tick, record.stamp).encode()
            self._keyframes.publish(UInt8MultiArray(data=array.array('B', data)))

    def _publish_scene(self) -> None:
        """
        Publish the scene if it has changed.

        Not before the first subscriber, as it takes as long as many substeps to write.  From then
        on at once: a late subscriber gets the last one.
        """
        scene = self._live.scene
        if scene is self._scene or (self._scene is None and not self._scenes.wanted):
            return
        if scene != self._scene:
            self._scenes.publish(String(data=scene_text(scene)))
        self._scene = scene
