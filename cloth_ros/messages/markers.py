"""The cloth, its colliders and the wind as a MarkerArray for RViz and other viewers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable

import numpy as np
from builtin_interfaces.msg import Time
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from .cdr import SerializedMessage
from .cloth_markers import pins_marker, sheet_marker, springs_marker, wind_marker
from .collider_markers import collider_markers
from .gripper_markers import gripper_markers
from .marker import MarkerState, MarkerWriter
from .published_cloth import PublishedCloth

# In the order of the message.
MARKERS: tuple[Callable[[PublishedCloth], Iterable[MarkerWriter]], ...] = (
    sheet_marker,
    pins_marker,
    springs_marker,
    wind_marker,
    collider_markers,
    gripper_markers,
)


# Namespace and number by which viewers know a marker.
Identity = tuple[str, int]


def deletion(identities: Iterable[Identity], frame_id: str) -> MarkerArray:
    """Return a message that deletes markers which viewers still show."""
    header = Header(frame_id=frame_id)
    markers = [
        Marker(header=header, ns=name, id=number, action=Marker.DELETE)
        for name, number in identities
    ]
    return MarkerArray(markers=markers)


def deletion_of_all(frame_id: str, seconds: int, nanoseconds: int) -> MarkerArray:
    """Return a message that deletes all markers of its topic, those of other nodes included."""
    stamp = Time(sec=seconds, nanosec=nanoseconds)
    marker = Marker(header=Header(stamp=stamp, frame_id=frame_id), action=Marker.DELETEALL)
    return MarkerArray(markers=[marker])


class MarkersMessage:
    """
    A MarkerArray with the namespaces `sheet`, `pins`, `springs`, `wind` and one per body.

    A marker without content is not in the message: no triangles of a single row of particles (its
    springs are shown instead), no pins, no collider, no air.  The markers of one namespace, as
    the parts of a capsule are, have numbers from 0.

    Parameters
    ----------
    cloth
        Its scene, colliders and grippers decide which markers there are.

    Attributes
    ----------
    identities
        Of its markers.

    """

    def __init__(self, cloth: PublishedCloth) -> None:
        sheet = cloth.scene.sheet
        self._positions = np.empty((sheet.rows, sheet.columns, 3))
        self._writers = [writer for make in MARKERS for writer in make(cloth)]
        markers = [writer.marker for writer in self._writers]
        counts: Counter[str] = Counter()
        for number, writer in enumerate(self._writers):
            writer.place(number)
            writer.marker.id = counts[writer.marker.ns]
            counts[writer.marker.ns] += 1
        self.identities = frozenset((marker.ns, marker.id) for marker in markers)
        self._message = SerializedMessage(MarkerArray(markers=markers))
        for writer in self._writers:
            writer.locate(self._message)
        self._message.freeze()
        for writer in self._writers:
            writer.bind(self._message)

    def serialise(self, cloth: PublishedCloth, seconds: int, nanoseconds: int) -> bytes:
        """Return the serialised message of the present state of `cloth`, stamped."""
        self._message.stamp(seconds, nanoseconds)
        cloth.write_positions(self._positions)
        state = MarkerState(cloth, self._positions, cloth.colliders)
        for writer in self._writers:
            writer.write(state)
        return self._message.tobytes()
