"""Markers of colliders, by their shape."""

from __future__ import annotations

from collections.abc import Iterator

from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from ..model.grid import Array
from .marker import MarkerWriter, PoseMarker, new_marker
from .published_cloth import PublishedCloth

_COLOUR = ColorRGBA(r=0.25, g=0.45, b=0.75, a=1.0)
_TYPES = {'sphere': Marker.SPHERE, 'box': Marker.CUBE, 'cylinder': Marker.CYLINDER}


def collider_markers(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield a marker for each collider; its namespace is the collider's name."""
    for name, collider in cloth.colliders.items():
        kind = _TYPES[collider.shape]
        marker = new_marker(name, kind, _COLOUR, 1.0, cloth.scene.frame_id)

        def write_pose(view: Array, cloth: PublishedCloth, name: str = name) -> None:
            """Write position, orientation and scale."""
            collider = cloth.colliders[name]
            view[:3], view[3:7], view[7:] = (
                collider.position,
                collider.orientation,
                collider.size,
            )

        yield PoseMarker(marker, write_pose)
