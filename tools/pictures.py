"""
Render the scenes for the README.

    python -m tools.pictures DIRECTORY

Each picture shows a scene of config/ at the time, and after the commands, that the README states.
Rendering is off screen; VTK needs EGL or OSMesa for it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyvista

from cloth_ros import Cloth, Scene
from cloth_ros.model.contact.collider import Collider
from cloth_ros.scene.quaternion import rotation_matrix
from examples.robot_arm import link_poses

_CONFIG = Path(__file__).parent.parent / 'config'
_SIZE = (900, 720)
# Share of the size, and distance, m, by which colliders are drawn smaller: the flat triangles of
# the cloth would intersect round ones of full size, and lie in the faces of flat ones.
_SMALLER, _GAP = 0.99, 0.002
_FINE = 64  # segments of a circle


class View(NamedTuple):
    """Position and focal point of the camera, and height of the floor, m; None: no floor."""

    eye: tuple[float, float, float]
    focus: tuple[float, float, float]
    floor: float | None


def _mesh(positions: np.ndarray) -> pyvista.PolyData:
    """Return both triangles of every quad of the grid."""
    rows, columns, _ = positions.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    corner, right, down, opposite = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    corners = np.stack([corner, right, down, opposite, down, right], axis=-1).reshape(-1, 3)
    return pyvista.PolyData.from_regular_faces(positions.reshape(-1, 3), corners)


def _square(centre: tuple[float, float, float]) -> pyvista.PolyData:
    """Return a horizontal square with a grid, which represents a plane."""
    return pyvista.Plane(center=centre, i_size=3, j_size=3, i_resolution=15, j_resolution=15)


def _shape(collider: Collider) -> pyvista.PolyData:
    """Return the surface of a collider about its own origin; that of a plane is a square."""
    its, inset = collider.parameters, collider.inset
    radius = _SMALLER * (its.radius - inset)
    fine = {'theta_resolution': _FINE, 'phi_resolution': _FINE}
    match collider.type:
        case 'plane':
            return _square((0, 0, -_GAP - inset))
        case 'sphere':
            return pyvista.Sphere(radius=radius, **fine)
        case 'box':
            x, y, z = (edge - 2 * (inset + _GAP) for edge in its.size)
            return pyvista.Cube(x_length=x, y_length=y, z_length=z)
        case 'capsule':
            return pyvista.Capsule(
                direction=(0, 0, 1), radius=radius, cylinder_length=its.length, resolution=_FINE
            )
        case 'cylinder':
            height = its.length - 2 * (inset + _GAP)
            return pyvista.Cylinder(
                direction=(0, 0, 1), radius=radius, height=height, resolution=_FINE
            )
    corners = np.asarray(collider.mesh_triangles, float).reshape(-1, 3)
    middle = corners.mean(axis=0)
    faces = np.arange(len(corners)).reshape(-1, 3)
    return pyvista.PolyData.from_regular_faces(middle + _SMALLER * (corners - middle), faces)


def _add_floor(plotter: pyvista.Plotter, floor: pyvista.PolyData) -> None:
    plotter.add_mesh(floor, color='#e9edf1', ambient=0.5, show_edges=True, edge_color='#c3ccd6')


def _add_collider(plotter: pyvista.Plotter, collider: Collider) -> None:
    """Draw a collider at its pose."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrix(collider.orientation)
    matrix[:3, 3] = collider.position
    surface = _shape(collider).transform(matrix, inplace=False)
    if collider.type == 'plane':
        _add_floor(plotter, surface)
        return
    # Edges between faces stay sharp.
    look = {'smooth_shading': True, 'split_sharp_edges': True, 'ambient': 0.25, 'specular': 0.4}
    plotter.add_mesh(surface, color='#4d7fc4', **look)


def render(cloth: Cloth, path: Path, view: View) -> None:
    """Draw a cloth, its colliders and its pins."""
    scene = cloth.scene
    plotter = pyvista.Plotter(off_screen=True, window_size=_SIZE, lighting='none')
    plotter.set_background('white', top='#d5dee8')
    plotter.enable_anti_aliasing('ssaa')
    plotter.add_mesh(
        _mesh(cloth.positions),
        color='#d0453c',
        backface_params={'color': '#e8a66a'},
        smooth_shading=True,
        ambient=0.3,
        specular=0.15,
        specular_power=8,
    )
    for collider in cloth.colliders.values():
        _add_collider(plotter, collider)
    pinned = cloth.positions[scene.pinned()]
    if len(pinned):
        pins = pyvista.PolyData(pinned).glyph(
            geom=pyvista.Sphere(radius=0.012), scale=False, orient=False
        )
        plotter.add_mesh(pins, color='#222222')
    if view.floor is not None:
        centre = (view.focus[0], view.focus[1], view.floor)
        _add_floor(plotter, _square(centre))
    sun = pyvista.Light(position=(view.eye[0] + 1.5, view.eye[1] + 0.5, 5), intensity=0.65)
    sky = pyvista.Light(position=(view.focus[0], view.focus[1], 6), intensity=0.25)
    head = pyvista.Light(light_type='headlight', intensity=0.3)
    for light in (sun, sky, head):
        light.focal_point = view.focus if light is not head else (0, 0, 0)
        plotter.add_light(light)
    plotter.camera.position = view.eye
    plotter.camera.focal_point = view.focus
    plotter.camera.up = (0, 0, 1)
    plotter.camera.view_angle = 28
    plotter.screenshot(path)
    plotter.close()


def _run(scene: str, seconds: float, command: Callable[[Cloth], None] | None = None) -> Cloth:
    """Return the cloth of a scene after some seconds; `command` is called before each tick."""
    cloth = Cloth(Scene.from_yaml(_CONFIG / scene))
    for _ in range(round(seconds * 60)):
        if command is not None:
            command(cloth)
        cloth.advance(1 / 60)
    return cloth


def _push(cloth: Cloth) -> None:
    """Move the small sphere from a height of 1.5 m down to 0.6 m at 20 m/s."""
    cloth.move_sphere((0.0, 0.0, max(1.5 - 20 * (cloth.time + 1 / 60), 0.6)))


def _reach(cloth: Cloth) -> None:
    """Move the links of the arm as examples/robot_arm.py does."""
    for name, pose in link_poses(cloth.time + 1 / 60).items():
        cloth.move_collider(name, *pose)


def main() -> None:
    """Render every picture into the directory of the command line."""
    directory = Path(sys.argv[1] if len(sys.argv) > 1 else 'docs/pictures')
    directory.mkdir(parents=True, exist_ok=True)
    hanging = View((1.8, -2.8, 1.75), (0, -0.2, 1.0), 0.35)
    pictures = {
        'falling': (_run('hanging.yaml', 0.35), hanging),
        'at_rest': (_run('hanging.yaml', 12.0), hanging),
        'wind': (_run('gust.yaml', 5.6), View((2.5, 2.3, 1.9), (0.0, 0.0, 1.32), 0.6)),
        'sphere': (_run('drop_on_sphere.yaml', 1.6), View((2.1, -2.5, 0.95), (0, 0, 0.72), 0.1)),
        'small_fast_sphere': (
            _run('small_fast_sphere.yaml', 1.0, _push),
            View((1.0, -1.9, 2.6), (0, 0, 0.75), 0.3),
        ),
        # With a floor of its own, a plane.
        'table': (_run('table.yaml', 2.5), View((1.9, -2.3, 0.8), (0, 0, 0.28), None)),
        'box': (_run('box.yaml', 1.6), View((1.8, -2.1, 1.2), (0, 0, 0.38), 0.0)),
        'robot_arm': (
            _run('robot_arm.yaml', 2.2, _reach),
            View((3.1, -3.2, 1.9), (0, -0.1, 0.78), 0.0),
        ),
    }
    for name, (cloth, view) in pictures.items():
        render(cloth, directory / f'{name}.png', view)
        print(directory / f'{name}.png')


if __name__ == '__main__':
    main()
