"""Markers of the cloth and the wind: triangles, pins, springs, an arrow."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from ..live.triangles import write_triangles
from ..model.forces.springs import spring_ends, spring_families
from ..model.grid import Array
from ..scene import Scene
from .cdr import SerializedMessage
from .marker import MarkerState, MarkerWriter, PointsMarker, new_marker
from .published_cloth import PublishedCloth

_SHEET_COLOUR = ColorRGBA(r=0.80, g=0.22, b=0.20, a=1.0)
_PIN_COLOUR = ColorRGBA(r=0.95, g=0.75, b=0.15, a=1.0)
_WIND_COLOUR = ColorRGBA(r=0.35, g=0.70, b=0.90, a=1.0)
_SPRING_COLOUR = ColorRGBA(r=0.15, g=0.15, b=0.18, a=1.0)

# Seconds of wind that its arrow represents: 5 m/s is shown as half a metre.
_ARROW_SECONDS = 0.1
_STILL_AIR = 1e-3  # m/s, below which no arrow is shown


def _has_triangles(scene: Scene) -> bool:
    return scene.sheet.rows > 1 and scene.sheet.columns > 1


def _thickness(scene: Scene) -> float:
    """Return a length that pins and lines are drawn in proportion to, m."""
    return 0.15 * min(scene.sheet.shortest_spacing, 0.2)


def sheet_marker(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield the triangles of the sheet; a single row of particles has none."""
    scene = cloth.scene
    if not _has_triangles(scene):
        return
    marker = new_marker('sheet', Marker.TRIANGLE_LIST, _SHEET_COLOUR, 1.0, scene.frame_id)
    cells = (scene.sheet.rows - 1) * (scene.sheet.columns - 1)

    def write(view: Array, state: MarkerState) -> None:
        write_triangles(state.positions, view)

    yield PointsMarker(marker, 6, cells, write)


def pins_marker(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield the pinned particles as balls."""
    scene = cloth.scene
    pinned = scene.pinned()
    if not pinned.any():
        return

    def write(view: Array, state: MarkerState) -> None:
        view[:, 0] = state.positions[pinned]

    diameter = 3 * _thickness(scene)
    marker = new_marker('pins', Marker.SPHERE_LIST, _PIN_COLOUR, diameter, scene.frame_id)
    yield PointsMarker(marker, 1, int(pinned.sum()), write)


def springs_marker(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield the springs as lines, by `markers.springs` or if the sheet has no triangles."""
    scene = cloth.scene
    if not scene.markers.springs and _has_triangles(scene):
        return
    families = list(spring_families(scene))
    grid = np.empty((3, scene.sheet.rows, scene.sheet.columns))
    count = sum(spring_ends(family, grid)[0][0].size for family in families)
    if not count:
        return

    def write(view: Array, state: MarkerState) -> None:
        start = 0
        for family in families:
            ends = spring_ends(family, np.moveaxis(state.positions, -1, 0))
            stop = start + ends[0][0].size
            for k, end in enumerate(ends):
                view[start:stop, k] = np.moveaxis(end, 0, -1).reshape(-1, 3)
            start = stop

    width = _thickness(scene) / 3
    marker = new_marker('springs', Marker.LINE_LIST, _SPRING_COLOUR, width, scene.frame_id)
    yield PointsMarker(marker, 2, count, write)


# Placeholder of the wind marker's `action`, which follows its `id` and `type`.  It is searched for
# with these: four bytes alone may also occur in padding, left over from another message.
_ACTION = 0x3C0F_FEE5
ACTION_PLACEHOLDER = np.array([0, Marker.ARROW, _ACTION], np.int32).tobytes()


class WindMarker:
    """An arrow along the wind that ends above the sheet; deleted while the air is still."""

    def __init__(self, scene: Scene) -> None:
        marker = new_marker('wind', Marker.ARROW, _WIND_COLOUR, 1.0, scene.frame_id)
        marker.scale = Vector3(x=0.02, y=0.05, z=0.08)
        marker.action = _ACTION
        x, y, z = scene.sheet.position
        self._end = np.array((x, y, z + 0.6 * max(scene.sheet.size)))
        self._arrow = PointsMarker(marker, 2, 1, self._write_arrow)
        self.marker = marker

    def place(self, number: int) -> None:
        """Put placeholders into both ends of the arrow."""
        self._arrow.place(number)

    def locate(self, message: SerializedMessage) -> None:
        """Find the action and the points."""
        self._offset = message.find(ACTION_PLACEHOLDER) + 8
        self._arrow.locate(message)

    def bind(self, message: SerializedMessage) -> None:
        """Take views of both."""
        self._action = message.view(self._offset, np.int32, (1,))
        self._arrow.bind(message)

    def write(self, state: MarkerState) -> None:
        """Write the arrow of the present wind."""
        still = math.hypot(*state.cloth.air_velocity) < _STILL_AIR
        self._action[0] = Marker.DELETE if still else Marker.ADD
        self._arrow.write(state)

    def _write_arrow(self, view: Array, state: MarkerState) -> None:
        view[0, 1] = self._end
        view[0, 0] = self._end - _ARROW_SECONDS * np.array(state.cloth.air_velocity)


def wind_marker(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield the wind, if there is air that acts on the sheet."""
    if cloth.scene.has_air:
        yield WindMarker(cloth.scene)
