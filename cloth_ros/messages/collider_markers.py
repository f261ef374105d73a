"""
Markers of colliders, by their shape.

All but meshes are drawn by primitives of the viewers, of which a capsule takes three.  A mesh is
a list of triangles, or the URL of its file: see `markers.meshes` of the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from ..model.contact.collider import Collider
from ..model.grid import Array
from ..scene import Scene
from ..scene.quaternion import rotation_matrix
from .marker import (
    MarkerState,
    MarkerWriter,
    PointsMarker,
    PosedPointsMarker,
    PoseMarker,
    WritePose,
    new_marker,
)
from .published_cloth import PublishedCloth

_COLOUR = ColorRGBA(r=0.25, g=0.45, b=0.75, a=1.0)
_PLANE_COLOUR = ColorRGBA(r=0.62, g=0.64, b=0.66, a=1.0)

# Viewers reject a scale of 0, which a shape has that is shrunk to nothing, m.
_LEAST_SCALE = 1e-6
# Flat faces are drawn this far, m, behind the surface, but at most this share of the shape: sheet
# and face would otherwise lie in one plane, of which viewers show either at random.
_GAP, _GAP_SHARE = 5e-4, 0.005
# Thickness of the square that represents a plane, as a share of its edge.
_PLANE_THICKNESS = 0.005

Vector = tuple[float, float, float]
# Centre in the frame of the collider and scale, m, of each of its markers.
_Parts = Callable[[Collider], tuple[tuple[Vector, Vector], ...]]
_ORIGIN = (0.0, 0.0, 0.0)


def _gap(length: float) -> float:
    """Return what is left out between surface and marker at both ends together, m."""
    return 2 * min(_GAP, _GAP_SHARE * length)


def _sphere(collider: Collider) -> tuple[tuple[Vector, Vector], ...]:
    diameter = 2 * (collider.parameters.radius - collider.inset)
    return ((_ORIGIN, (diameter, diameter, diameter)),)


def _box(collider: Collider) -> tuple[tuple[Vector, Vector], ...]:
    x, y, z = (edge - _gap(edge) - 2 * collider.inset for edge in collider.parameters.size)
    return ((_ORIGIN, (x, y, z)),)


def _cylinder(collider: Collider) -> tuple[tuple[Vector, Vector], ...]:
    diameter = 2 * (collider.parameters.radius - collider.inset)
    length = collider.parameters.length
    return ((_ORIGIN, (diameter, diameter, length - _gap(length) - 2 * collider.inset)),)


def _capsule(collider: Collider) -> tuple[tuple[Vector, Vector], ...]:
    diameter = 2 * (collider.parameters.radius - collider.inset)
    length, ball = collider.parameters.length, (diameter, diameter, diameter)
    return (
        (_ORIGIN, (diameter, diameter, length)),
        ((0.0, 0.0, length / 2), ball),
        ((0.0, 0.0, -length / 2), ball),
    )


def _plane(edge: float, collider: Collider) -> tuple[tuple[Vector, Vector], ...]:
    thickness = _PLANE_THICKNESS * edge
    return (((0.0, 0.0, -thickness / 2 - _GAP - collider.inset), (edge, edge, thickness)),)


def _plane_edge(collider: Collider, scene: Scene) -> float:
    """Return the edge, m, of a square about the origin of a plane that reaches past the sheet."""
    away = np.subtract(scene.sheet.position, collider.position)
    x, y, _ = (away @ rotation_matrix(collider.orientation)).tolist()
    return float(2 * max(abs(x), abs(y)) + 4 * max(scene.sheet.size))


_PRIMITIVES: dict[str, tuple[tuple[int, ...], _Parts]] = {
    'sphere': ((Marker.SPHERE,), _sphere),
    'box': ((Marker.CUBE,), _box),
    'cylinder': ((Marker.CYLINDER,), _cylinder),
    'capsule': ((Marker.CYLINDER, Marker.SPHERE, Marker.SPHERE), _capsule),
}


def collider_markers(cloth: PublishedCloth) -> Iterator[MarkerWriter]:
    """Yield the markers of each collider; their namespace is the collider's name."""
    for name, collider in cloth.colliders.items():
        if collider.type == 'mesh':
            yield _mesh_marker(name, collider, cloth.scene)
            continue
        colour = _COLOUR
        if collider.type == 'plane':
            colour = _PLANE_COLOUR
            kinds: tuple[int, ...] = (Marker.CUBE,)
            parts: _Parts = partial(_plane, _plane_edge(collider, cloth.scene))
        else:
            kinds, parts = _PRIMITIVES[collider.type]
        for index, kind in enumerate(kinds):
            marker = new_marker(name, kind, colour, 1.0, cloth.scene.frame_id)
            yield PoseMarker(marker, _write_part(name, parts, index))


def _write_part(name: str, parts: _Parts, index: int) -> WritePose:
    def write(view: Array, state: MarkerState) -> None:
        collider = state.colliders[name]
        centre, scale = parts(collider)[index]
        _write_pose(view, collider, np.array(centre), np.array(scale))

    return write


def _write_pose(view: Array, collider: Collider, centre: Array, scale: Array) -> None:
    """Write the pose and the scale of a marker at `centre`, m, in the frame of a collider."""
    view[:3] = collider.position
    if centre.any():
        view[:3] += rotation_matrix(collider.orientation) @ centre
    view[3:7] = collider.orientation
    view[7:] = np.maximum(scale, _LEAST_SCALE)


class _Mesh:
    """
    Writes the marker of a mesh, which is scaled down about the mean of its corners to shrink.

    Parameters
    ----------
    name
        Of the collider.
    triangles
        In the frame of the collider, m, shape (count, 3, 3).

    """

    def __init__(self, name: str, triangles: Array) -> None:
        self._name, self._triangles = name, triangles
        self._middle = triangles.mean((0, 1))
        self._thickness = float(np.ptp(triangles, (0, 1)).min())
        self._inset = -1.0  # of the triangles that were written last

    def _factor(self, inset: float) -> float:
        """Return the size as a share of the full one: the thinnest side shrinks by the inset."""
        return max(1 - 2 * inset / max(self._thickness, _LEAST_SCALE), _LEAST_SCALE)

    def write_file_pose(self, view: Array, state: MarkerState) -> None:
        """Write the pose and the scale of a marker that shows the file."""
        collider = state.colliders[self._name]
        factor = self._factor(collider.inset)
        _write_pose(view, collider, (1 - factor) * self._middle, np.full(3, factor))

    def write_pose(self, view: Array, state: MarkerState) -> None:
        """Write the pose of the triangles."""
        _write_pose(view, state.colliders[self._name], np.zeros(3), np.ones(3))

    def write_triangles(self, view: Array, state: MarkerState) -> None:
        """Write the triangles where they have changed: in the first message and during growth."""
        inset = state.colliders[self._name].inset
        if inset != self._inset:
            self._inset = inset
            # Not by the scale of the marker, which Foxglove ignores for triangles.
            view[...] = self._middle + self._factor(inset) * (self._triangles - self._middle)


def _mesh_marker(name: str, collider: Collider, scene: Scene) -> MarkerWriter:
    triangles = np.asarray(collider.mesh_triangles, float)
    mesh = _Mesh(name, triangles)
    if scene.markers.meshes == 'file':
        marker = new_marker(name, Marker.MESH_RESOURCE, _COLOUR, 1.0, scene.frame_id)
        marker.mesh_resource = Path(collider.parameters.mesh).absolute().as_uri()
        return PoseMarker(marker, mesh.write_file_pose)
    marker = new_marker(name, Marker.TRIANGLE_LIST, _COLOUR, 1.0, scene.frame_id)
    points = PointsMarker(marker, 3, len(triangles), mesh.write_triangles)
    return PosedPointsMarker(PoseMarker(marker, mesh.write_pose), points)
