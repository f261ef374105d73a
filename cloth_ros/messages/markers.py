"""The cloth and what acts on it as markers for RViz and other viewers."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from ..model import Cloth
from ..model.forces.springs import spring_ends, spring_families
from ..model.grid import Array
from ..model.kernels.jit import exact
from .cdr import STAMP, SerializedMessage

_SHEET_COLOUR = ColorRGBA(r=0.80, g=0.22, b=0.20, a=1.0)
_PIN_COLOUR = ColorRGBA(r=0.95, g=0.75, b=0.15, a=1.0)
_SPHERE_COLOUR = ColorRGBA(r=0.25, g=0.45, b=0.75, a=1.0)
_WIND_COLOUR = ColorRGBA(r=0.35, g=0.70, b=0.90, a=1.0)
_SPRING_COLOUR = ColorRGBA(r=0.15, g=0.15, b=0.18, a=1.0)

# Seconds that the wind arrow is long for: 5 m/s is shown as half a metre.
_ARROW_SECONDS = 0.1


def _sentinel(number: int, count: int) -> list[float]:
    """
    Return numbers that stand nowhere else in the message, different for each `number`.

    Nor in a frame's name: three of them in a row are no UTF-8.
    """
    return [1.0e17 + 1024.0 * (100 * number + i) for i in range(count)]


def _points(numbers: list[float]) -> list[Point]:
    return [
        Point(x=x, y=y, z=z)
        for x, y, z in zip(numbers[::3], numbers[1::3], numbers[2::3], strict=True)
    ]


def deletion(namespaces: Iterable[str], frame_id: str) -> MarkerArray:
    """Return a message that takes away what viewers still show of markers that are no more."""
    header = Header(frame_id=frame_id)
    markers = [Marker(header=header, ns=name, action=Marker.DELETE) for name in namespaces]
    return MarkerArray(markers=markers)


@exact
def _write_quads(positions, out):  # type: ignore[no-untyped-def]
    """Write the corners of both triangles of every quad; three times as fast as NumPy."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            for axis in range(3):
                right, down = positions[row, column + 1, axis], positions[row + 1, column, axis]
                out[row, column, axis] = positions[row, column, axis]
                out[row, column, 3 + axis] = right
                out[row, column, 6 + axis] = down
                out[row, column, 9 + axis] = positions[row + 1, column + 1, axis]
                out[row, column, 12 + axis] = down
                out[row, column, 15 + axis] = right


class MarkersMessage:
    """
    A MarkerArray of the namespaces `sheet`, `pins`, `sphere`, `wind` and `springs`.

    A marker that the scene has no use for is not in the message: no triangles in a single row of
    particles (its springs are shown instead), no pins, no sphere, no air.
    """

    def __init__(self, cloth: Cloth) -> None:
        scene = cloth.scene
        rows, columns = scene.sheet.rows, scene.sheet.columns
        self._scene = scene
        # What one of the markers is made of is as thick as this, m.
        self._thickness = 0.15 * min(scene.sheet.shortest_spacing, 0.2)
        self._pinned = scene.pinned()
        self._positions = np.empty((rows, columns, 3))
        sheet = rows > 1 and columns > 1
        lines = scene.markers.springs or not sheet
        self._families = list(spring_families(scene)) if lines else []
        springs = [spring_ends(family, self._grid)[0][0].size for family in self._families]
        pins = int(self._pinned.sum())

        lists = []  # marker, points in its placeholder, repetitions
        if sheet:
            marker = self._marker('sheet', Marker.TRIANGLE_LIST, _SHEET_COLOUR, 1.0)
            lists.append((marker, 6, (rows - 1) * (columns - 1)))
        if pins:
            marker = self._marker('pins', Marker.SPHERE_LIST, _PIN_COLOUR, 3 * self._thickness)
            lists.append((marker, 1, pins))
        if sum(springs):
            marker = self._marker('springs', Marker.LINE_LIST, _SPRING_COLOUR, self._thickness / 3)
            lists.append((marker, 2, sum(springs)))
        if scene.has_air:
            marker = self._marker('wind', Marker.ARROW, _WIND_COLOUR, 1.0)
            marker.scale = Vector3(x=0.02, y=0.05, z=0.08)
            marker.action = _ACTION
            lists.append((marker, 2, 1))
        markers = []
        for number, (marker, length, _) in enumerate(lists):
            marker.points = _points(_sentinel(number, 3 * length))
            markers.append(marker)
        if scene.sphere.radius > 0:
            marker = self._marker('sphere', Marker.SPHERE, _SPHERE_COLOUR, 2 * scene.sphere.radius)
            centre = _sentinel(len(lists), 3)
            marker.pose.position = _points(centre)[0]
            markers.append(marker)

        self._template = SerializedMessage(MarkerArray(markers=markers))
        places: dict[str, tuple[int, tuple[int, ...]]] = {}
        for number, (marker, length, count) in enumerate(lists):
            mark = np.array(_sentinel(number, 3 * length)).tobytes()
            places[marker.ns] = self._template.stretch(mark, length, count), (count, length, 3)
        if scene.sphere.radius > 0:
            # Its position, and behind that its orientation and scale.
            places['sphere'] = self._template.place(np.array(centre).tobytes()), (10,)
        action = self._template.place(_ACTION_MARK) + 8 if 'wind' in places else None
        self._template.freeze()
        self._views = {
            name: self._template.view(place, np.float64, shape)
            for name, (place, shape) in places.items()
        }
        self._action = None if action is None else self._template.view(action, np.int32, (1,))

    @property
    def namespaces(self) -> frozenset[str]:
        """Namespaces of the markers in the message."""
        return frozenset(self._views)

    @property
    def _grid(self) -> Array:
        return np.moveaxis(self._positions, -1, 0)

    def _marker(self, namespace: str, kind: int, colour: ColorRGBA, scale: float) -> Marker:
        marker = Marker(
            header=Header(stamp=STAMP, frame_id=self._scene.frame_id),
            ns=namespace,
            type=kind,
            color=colour,
            scale=Vector3(x=scale, y=scale, z=scale),
        )
        marker.pose.orientation.w = 1.0
        return marker

    def serialise(self, cloth: Cloth, seconds: int, nanoseconds: int) -> bytes:
        """Return the message for the present state of `cloth`, stamped."""
        self._template.stamp(seconds, nanoseconds)
        cloth.write_positions(self._positions)
        views = self._views
        if 'sheet' in views:
            self._write_triangles(views['sheet'])
        if 'pins' in views:
            views['pins'][:, 0] = self._positions[self._pinned]
        if 'springs' in views:
            self._write_springs(views['springs'])
        if 'sphere' in views:
            views['sphere'][:3] = cloth.sphere_position
            views['sphere'][7:] = 2 * cloth.sphere_radius
        if 'wind' in views:
            self._write_wind(views['wind'][0], cloth.air_velocity)
        return self._template.tobytes()

    def _write_triangles(self, view: Array) -> None:
        rows, columns, _ = self._positions.shape
        _write_quads(self._positions, view.reshape(rows - 1, columns - 1, 18))

    def _write_springs(self, view: Array) -> None:
        start = 0
        for family in self._families:
            first, second = spring_ends(family, self._grid)
            stop = start + first[0].size
            for k, end in enumerate((first, second)):
                view[start:stop, k] = np.moveaxis(end, 0, -1).reshape(-1, 3)
            start = stop

    def _write_wind(self, view: Array, velocity: tuple[float, float, float]) -> None:
        """Draw the wind as an arrow that ends beside the sheet; no wind, no arrow."""
        assert self._action is not None
        still = math.hypot(*velocity) < 1e-3
        self._action[0] = Marker.DELETE if still else Marker.ADD
        sheet = self._scene.sheet
        arrow = _ARROW_SECONDS * np.array(velocity)
        x, y, z = sheet.position
        view[1] = x, y, z + 0.6 * max(sheet.size)
        view[0] = view[1] - arrow


# In the place of the wind marker's `action`, which follows its `id` and `type`.
_ACTION = 0x3C0F_FEE5
# Together with these: four bytes alone may stand in padding, left over from another message.
_ACTION_MARK = np.array([0, Marker.ARROW, _ACTION], np.int32).tobytes()
