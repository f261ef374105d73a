"""Markers of colliders, by their shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from ..model.contact.sphere_collider import SphereCollider
from ..model.grid import Array
from .marker import MarkerWriter, PoseMarker, new_marker
from .published_cloth import PublishedCloth

_COLOUR = ColorRGBA(r=0.25, g=0.45, b=0.75, a=1.0)


def _write_sphere(view: Array, sphere: SphereCollider) -> None:
    view[:3] = sphere.position
    view[7:] = 2 * sphere.radius


# Type of the marker, and what writes position, orientation x y z w and scale, shape (10,), of a
# collider, by its class.  A new shape is one more entry.
_SHAPES: dict[type, tuple[int, Callable[[Array, Any], None]]] = {
    SphereCollider: (Marker.SPHERE, _write_sphere),
}


def collider_markers(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield a marker for each collider; its namespace is the collider's name."""
    for name, collider in cloth.colliders.items():
        kind, write = _SHAPES[type(collider)]
        marker = new_marker(name, kind, _COLOUR, 1.0, cloth.scene.frame_id)

        def write_pose(
            view: Array,
            cloth: PublishedCloth,
            name: str = name,
            write: Callable[[Array, Any], None] = write,
        ) -> None:
            write(view, cloth.colliders[name])

        yield PoseMarker(marker, write_pose)
