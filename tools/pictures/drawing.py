"""Objects of a picture: cloth with its weave, pins, colliders, ground and scale bar."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from cloth_ros.scene.quaternion import rotation_matrix

from .capture import Frame
from .light import GROUND_ALBEDO, linear

Array = NDArray[np.float64]

# Colours that stay apart for the colour-blind (Okabe and Ito), in sRGB.
_FRONT, _BACK = '#d55e00', '#f5d9a8'
_COLLIDER, _PIN = '#0072b2', '#202428'
_DARK, _LIGHT = '#2b2f33', '#ffffff'

_CHECK = 0.1  # m, from one stripe of the weave to the next
_TEXELS = 1024
# Share of the size, and distance, m, by which colliders are drawn smaller: the flat triangles of
# the cloth would intersect round ones of full size, and lie in the faces of flat ones.
_SMALLER, _GAP = 0.988, 0.002
_FINE = 96  # segments of a circle
_BAR_PARTS = 5


def _weave(size: Sequence[float]) -> pyvista.Texture:
    """Return woven stripes, whose checks are squares in a sheet without strain."""
    shade = np.ones((_TEXELS, _TEXELS))
    for axis, length in enumerate(reversed(size)):
        along = (np.arange(_TEXELS) + 0.5) / _TEXELS * length
        checks = max(round(length / _CHECK), 4)
        phase = along / length * checks % 1
        stripe = np.where(phase < 0.5, 0.72, 1.0)
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
) -> None:
    """
    Draw cloth, pins and colliders.

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
    plotter.add_mesh(
        cloth_mesh(frame.positions),
        color=linear(_FRONT),
        backface_params={'color': linear(_BACK)},
        texture=_weave(size),
        smooth_shading=True,
        ambient=0,
        specular=0,
    )
    for marker in frame.markers:
        if marker.type == Marker.SPHERE_LIST:
            plotter.add_mesh(_pins(marker), color=linear(_PIN), ambient=0, smooth_shading=True)
        elif marker.ns not in planes and (mesh := collider_mesh(marker)) is not None:
            look = {'smooth_shading': True, 'split_sharp_edges': True, 'ambient': 0}
            plotter.add_mesh(mesh, color=linear(_COLLIDER), specular=0.15, specular_power=20, **look)


def add_ground(plotter: pyvista.Plotter, centre: Sequence[float], radius: float) -> pyvista.Actor:
    """Draw a round ground whose colour is that of the background at its edge."""
    disc = pyvista.Disc(center=centre, inner=0, outer=radius, r_res=1, c_res=128)
    colour = (GROUND_ALBEDO,) * 3
    return plotter.add_mesh(disc, color=colour, ambient=0, specular=0, name='ground')


def add_scale_bar(
    plotter: pyvista.Plotter, centre: Array, along: Array, length: float
) -> list[pyvista.Actor]:
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
    height, width = 0.004, 0.05 * length
    turn = np.degrees(np.arctan2(along[1], along[0]))
    actors = []
    for part in range(_BAR_PARTS):
        box = pyvista.Cube(
            center=((part + 0.5) / _BAR_PARTS * length - length / 2, 0, height / 2),
            x_length=length / _BAR_PARTS,
            y_length=width,
            z_length=height,
        )
        colour = linear(_DARK if part % 2 == 0 else _LIGHT)
        mesh = box.rotate_z(turn, inplace=False).translate(centre, inplace=False)
        actors.append(plotter.add_mesh(mesh, color=colour, ambient=0))
    text = pyvista.Text3D(f'{length:g} m', height=0.16 * length, depth=0.002)
    text.points -= np.array([text.center[0], text.bounds[3] + 1.2 * width, text.bounds[4]])
    text = text.rotate_z(turn, inplace=False).translate(centre, inplace=False)
    actors.append(plotter.add_mesh(text, color=linear(_DARK), ambient=0))
    return actors
