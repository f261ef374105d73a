"""The topic `~/markers`: cloth, colliders and wind for viewers, at `markers.rate`."""

from __future__ import annotations

from visualization_msgs.msg import MarkerArray

from ...messages.markers import Identity, MarkersMessage, deletion, deletion_of_all
from ...scene import Scene
from ..context import Context
from ..publisher import TolerantPublisher
from .rate_limit import RateLimit


class MarkersOutput:
    """
    Publish the markers, and delete those that the scene has no longer.

    A viewer keeps the markers of a node that has ended.  To each subscriber that appears, a
    message that deletes all is therefore sent first.  The markers follow at once: other
    subscribers receive it too.
    """

    def __init__(self, context: Context) -> None:
        self._live = context.live
        self._publisher = TolerantPublisher(context, MarkerArray, '~/markers')
        self._message: MarkersMessage | None = None
        self._scene: Scene | None = None
        self._published: frozenset[Identity] = frozenset()
        self._limit = RateLimit()
        self._subscribers = 0
        self.topics = (self._publisher.topic,)

    def publish(self, now: float, stamp: int) -> None:
        """Publish the present state, stamped in ns, if it is time and there is a subscriber."""
        times = divmod(stamp, 1_000_000_000)
        former, self._subscribers = self._subscribers, self._publisher.subscribers
        if self._subscribers > former:
            self._limit.advance_to(now)
            frame_id = self._live.scene.frame_id
            self._publisher.publish(deletion_of_all(frame_id, *times))
        if self._due(now) and self._subscribers:
            self._publisher.publish(self._current_message().serialise(self._live, *times))

    def _current_message(self) -> MarkersMessage:
        """Return the message of the present scene."""
        scene = self._live.scene
        if self._message is None or scene is not self._scene:
            self._message, self._scene = MarkersMessage(self._live), scene
            removed = self._published - self._message.identities
            if removed:
                self._publisher.publish(deletion(removed, scene.frame_id))
            self._published = self._message.identities
        return self._message

    def _due(self, now: float) -> bool:
        """Return whether markers are due at `now`, s."""
        scene = self._live.scene
        rate = scene.markers.rate
        return rate > 0 and self._limit.due(now, rate, scene.rate)
