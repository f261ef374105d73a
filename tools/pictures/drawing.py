"""Objects of a picture: cloth with its weave, pins, colliders, ground and scale bar."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from cloth_ros.scene.quaternion import rotation_matrix

from .capture import Frame
from .light import linear

Array = NDArray[np.float64]

# Colours that stay apart for the colour-blind (Okabe and Ito), in sRGB.
_FRONT, _BACK = '#e8702a', '#f7e3bd'
_COLLIDER, _PIN = '#0072b2', '#202428'
_DARK, _LIGHT = '#2b2f33', '#ffffff'

_CHECK = 0.1  # m, from one stripe of the weave to the next
_TEXELS = 1024
# Share of the size, and distance, m, by which colliders are drawn smaller: the flat triangles of
# the cloth would intersect round ones of full size, and lie in the faces of flat ones.
_SMALLER, _GAP = 0.988, 0.002
_FINE = 96  # segments of a circle
_BAR_PARTS, _TEXT = 5, 0.13  # height of the text / length of the bar
_LAYER = 0.001  # m, between what is drawn on the ground
_LINES, _LINE_SHADE = 0.5, 0.72  # m between lines of the ground, and their linear intensity


def _weave(size: Sequence[float]) -> pyvista.Texture:
    """Return woven stripes, whose checks are squares in a sheet without strain."""
    shade = np.ones((_TEXELS, _TEXELS))
    for axis, length in enumerate(reversed(size)):
        along = (np.arange(_TEXELS) + 0.5) / _TEXELS * length
        checks = max(round(length / _CHECK), 4)
        phase = along / length * checks % 1
        stripe = np.where(phase < 0.5, 0.82, 1.0)
        shade *= stripe[:, None] if axis == 0 else stripe[None, :]
    texture = pyvista.Texture(np.repeat((255 * shade)[..., None], 3, axis=2).astype(np.uint8))
    texture.mipmap = texture.interpolate = True
    return texture


def cloth_mesh(positions: Array) -> pyvista.PolyData:
    """Return both triangles of every quad of the grid, with coordinates of the texture."""
    rows, columns, _ = positions.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    corner, right, down, opposite = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    corners = np.stack([corner, right, down, opposite, down, right], axis=-1).reshape(-1, 3)
    mesh = pyvista.PolyData.from_regular_faces(positions.reshape(-1, 3).astype(float), corners)
    v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing='ij')
    mesh.active_texture_coordinates = np.stack([u, v], axis=-1).reshape(-1, 2)
    return mesh


def _unit_shape(marker: Marker) -> pyvista.PolyData | None:
    """Return the shape of a marker about its origin, drawn a little smaller."""
    x, y, z = marker.scale.x, marker.scale.y, marker.scale.z
    match marker.type:
        case Marker.SPHERE:
            return pyvista.Sphere(
                radius=_SMALLER * x / 2, theta_resolution=_FINE, phi_resolution=_FINE
            )
        case Marker.CUBE:
            x, y, z = (edge - 2 * _GAP for edge in (x, y, z))
            return pyvista.Cube(x_length=x, y_length=y, z_length=z)
        case Marker.CYLINDER:
            return pyvista.Cylinder(
                direction=(0, 0, 1), radius=_SMALLER * x / 2, height=z, resolution=_FINE
            )
        case Marker.TRIANGLE_LIST:
            points = np.array([(each.x, each.y, each.z) for each in marker.points])
            middle = points.mean(axis=0)
            faces = np.arange(len(points)).reshape(-1, 3)
            points = middle + _SMALLER * (points - middle)
            return pyvista.PolyData.from_regular_faces(points, faces)
    return None


def collider_mesh(marker: Marker) -> pyvista.PolyData | None:
    """Return the surface of the marker of a collider in the world; None: nothing to draw."""
    shape = _unit_shape(marker)
    if shape is None:
        return None
    place, turn = marker.pose.position, marker.pose.orientation
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrix((turn.x, turn.y, turn.z, turn.w))
    matrix[:3, 3] = place.x, place.y, place.z
    return shape.transform(matrix, inplace=False)


def _pins(marker: Marker) -> pyvista.PolyData:
    points = pyvista.PolyData([(each.x, each.y, each.z) for each in marker.points])
    ball = pyvista.Sphere(radius=max(0.5 * marker.scale.x, 0.008))
    return points.glyph(geom=ball, scale=False, orient=False)


def extent(frame: Frame, planes: Sequence[str]) -> Array:
    """Return points that enclose what is drawn of a frame, m, shape (count, 3)."""
    parts = [frame.positions.reshape(-1, 3).astype(float)]
    for marker in frame.markers:
        if marker.ns not in planes and (mesh := collider_mesh(marker)) is not None:
            parts.append(np.asarray(mesh.points, float))
    return np.concatenate(parts)


def add_frame(
    plotter: pyvista.Plotter, frame: Frame, size: Sequence[float], planes: Sequence[str]
) -> list[pyvista.PolyData]:
    """
    Draw cloth, pins and colliders, and return their surfaces.

    Parameters
    ----------
    plotter
        What to draw into.
    frame
        State that was captured.
    size
        Of the sheet along its columns and rows, m.
    planes
        Colliders that the ground stands for.

    """
    cloth = cloth_mesh(frame.positions)
    plotter.add_mesh(
        cloth,
        color=linear(_FRONT),
        backface_params={'color': linear(_BACK)},
        texture=_weave(size),
        smooth_shading=True,
        ambient=0,
        specular=0,
    )
    meshes = [cloth]
    for marker in frame.markers:
        if marker.type == Marker.SPHERE_LIST:
            mesh, colour = _pins(marker), _PIN
        elif marker.ns not in planes and (shape := collider_mesh(marker)) is not None:
            mesh, colour = shape, _COLLIDER
        else:
            continue
        look = {'smooth_shading': True, 'split_sharp_edges': True, 'ambient': 0}
        plotter.add_mesh(mesh, color=linear(colour), specular=0.12, specular_power=16, **look)
        meshes.append(mesh)
    return meshes


def add_ground_lines(plotter: pyvista.Plotter, centre: Array, radius: float) -> None:
    """Draw lines of a square grid on the ground that fade out at a radius, m."""
    steps = np.arange(-np.ceil(radius / _LINES), np.ceil(radius / _LINES) + 1) * _LINES
    along = np.linspace(-radius, radius, 60)
    origin = np.round(centre / _LINES) * _LINES
    for step in steps:
        for across in (0, 1):
            points = np.tile((origin[0], origin[1], centre[2]), (len(along), 1))
            points[:, across] += step
            points[:, 1 - across] += along
            line = pyvista.lines_from_points(points)
            away = np.linalg.norm(points - centre, axis=1) / radius
            shade = 1 - (1 - _LINE_SHADE) * np.clip(1 - away, 0, 1)
            line['shade'] = np.repeat(np.round(255 * shade)[:, None], 3, axis=1).astype(np.uint8)
            plotter.add_mesh(line, scalars='shade', rgb=True, lighting=False, line_width=1)


def add_scale_bar(plotter: pyvista.Plotter, centre: Array, along: Array, length: float) -> None:
    """
    Draw a bar on the ground, in five parts, and its length.

    Parameters
    ----------
    plotter
        What to draw into.
    centre
        Middle of the bar on the ground, m.
    along
        Unit vector along the bar, horizontal.
    length
        Of the bar, m.

    """
    width, rim = 0.07 * length, 0.012 * length
    turn = np.degrees(np.arctan2(along[1], along[0]))

    def add(mesh: pyvista.PolyData, colour: str) -> None:
        placed = mesh.rotate_z(turn, inplace=False).translate(centre, inplace=False)
        plotter.add_mesh(placed, color=linear(colour), lighting=False)

    def rectangle(x: float, layer: int, edge_x: float, edge_y: float) -> pyvista.PolyData:
        return pyvista.Plane(center=(x, 0, layer * _LAYER), i_size=edge_x, j_size=edge_y)

    add(rectangle(0, 1, length + 2 * rim, width + 2 * rim), _DARK)
    for part in range(1, _BAR_PARTS, 2):
        x = (part + 0.5) / _BAR_PARTS * length - length / 2
        add(rectangle(x, 2, length / _BAR_PARTS, width), _LIGHT)
    text = pyvista.Text3D(f'{length:g} m', height=_TEXT * length, depth=0)
    text.points -= np.array([text.center[0], text.bounds[3] + 1.2 * width, -_LAYER])
    add(text, _DARK)
