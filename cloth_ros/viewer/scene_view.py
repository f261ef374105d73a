"""The scene of the page: light, ground, camera, and everything of one cloth."""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from .actions import Actions
from .cloth_client import ClothClient
from .collider_view import ColliderView
from .particles import Sheet
from .sheet_view import SheetView
from .wind_view import WindView, place_of_wind

_DISTANCE = 2.0  # of the camera, in diagonals of the sheet
_FIELD_OF_VIEW = 0.75  # rad, vertical
_VIEW = np.array([0.62, -0.7, 0.34])  # from the middle to the camera
_EMPTY = (2.2, -2.5, 1.8), (0.0, 0.0, 0.8)  # camera and middle, m, before there is a cloth
_NEAR = 1.5  # in lengths of the sheet: farther colliders need not be in view
_LAMP = np.array([-0.45, -0.75, 1.0])  # from the middle to the lamp


class Stage:
    """
    Light, ground and camera.

    One lamp casts shadows.  The lights of viser, with an environment map, look much the same and
    take several times longer to draw where a browser has no graphics processor.

    Parameters
    ----------
    server
        Of the page.

    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server, scene = server, server.scene
        scene.set_up_direction('+z')
        scene.configure_default_lights(False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere(
            '/light/sky', sky_color=(255, 255, 255), ground_color=(168, 162, 156), intensity=2.2
        )
        self._lamp = scene.add_light_spot(
            '/light/lamp', intensity=2.6, angle=0.4, penumbra=0.7, decay=0.0, cast_shadow=True
        )
        # From the camera's side, without shadow: folds are seen on both sides of a sheet.
        scene.add_light_directional('/light/fill', intensity=0.9, position=(3.0, -1.0, 1.5))
        scene.add_light_directional('/light/rim', intensity=0.7, position=(-1.0, 3.0, 1.5))
        self._ground = scene.add_grid(
            '/ground', width=8.0, height=8.0, cell_size=0.1, section_size=1.0,
            cell_color=(222, 224, 228), section_color=(178, 182, 190), shadow_opacity=0.3,
            plane_color=(246, 246, 247), plane_opacity=1.0, fade_distance=14.0, fade_strength=2.0,
        )  # fmt: skip
        server.initial_camera.position, server.initial_camera.look_at = _EMPTY

    def frame(self, points: NDArray[np.float64]) -> None:
        """Direct camera and lamp at points, m, shape (count, 3); ground at z = 0, or below."""
        low, high = points.min(0), points.max(0)
        size = max(float(np.linalg.norm(high - low)), 0.1)
        middle = (low + high) / 2
        if low[2] >= 0 and middle[2] < 2 * size:
            middle[2] *= 0.85  # a part of the ground too
        floor = 0.0 if low[2] >= 0 else low[2] - size
        self._ground.position = (middle[0], middle[1], floor - 1e-3)
        lamp = _LAMP / np.linalg.norm(_LAMP) * 4 * size
        self._lamp.position = middle + lamp
        self._lamp.direction = tuple((-lamp).tolist())
        camera = middle + _VIEW / np.linalg.norm(_VIEW) * _DISTANCE * size
        self._server.initial_camera.position = tuple(camera.tolist())
        self._server.initial_camera.fov = _FIELD_OF_VIEW
        self._server.initial_camera.look_at = tuple(middle.tolist())
        for client in self._server.get_clients().values():
            with client.atomic():
                client.camera.position, client.camera.look_at = camera, middle
                client.camera.fov = _FIELD_OF_VIEW

    def show_shadows(self, visible: bool) -> None:
        """Show or leave out what the lamp casts."""
        self._lamp.cast_shadow = visible

    def show_ground(self, visible: bool) -> None:
        """Show or hide the ground."""
        self._ground.visible = visible


class ClothView:
    """
    Draw one cloth.

    Parameters
    ----------
    scene
        Of the page.
    client
        The cloth.
    actions
        Take what the user does.

    Attributes
    ----------
    sheet, colliders
        Its parts, with settings of their own.

    """

    def __init__(self, scene: viser.SceneApi, client: ClothClient, actions: Actions) -> None:
        path = f'/cloths{client.name.node}'
        self._client = client
        self._root = scene.add_frame(path, show_axes=False)
        self.sheet = SheetView(scene, f'{path}/sheet')
        self._wind = WindView(scene, path)
        self._shapes_revision = 0

        def move(name: str, pose: object) -> None:
            actions.put((client.name, 'move', name), lambda: client.poses.move(name, pose))  # type: ignore[arg-type]

        self.colliders = ColliderView(scene, path, move)

    @property
    def visible(self) -> bool:
        """True if the cloth is shown."""
        return bool(self._root.visible)

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._root.visible = visible

    def points(self) -> NDArray[np.float64]:
        """Return what the camera should show, m, (count, 3): sheet, colliders near it, wind."""
        sheet = self._client.sheet
        if sheet is None:
            return np.empty((0, 3))
        particles = sheet.positions.reshape(-1, 3).astype(float)
        near, middle = _NEAR * float(np.ptp(particles, 0).max()), particles.mean(0)
        places = [pose.position for pose in self._client.poses.present.values()]
        places = [each for each in places if math.dist(each, middle) < near]
        return np.concatenate([particles, np.reshape(places, (-1, 3)), [place_of_wind(sheet)]])

    def draw(self, sheet: Sheet | None) -> None:
        """Draw what has changed: a new state, colliders, wind."""
        client = self._client
        if sheet is None and self.sheet.is_empty:  # the colours have changed, and no state comes
            sheet = client.sheet
        if sheet is not None:
            self.sheet.spacing = client.spacing
            self.sheet.draw(sheet)
        if client.shapes is not None and client.shapes_revision != self._shapes_revision:
            self._shapes_revision = client.shapes_revision
            self.colliders.show(client.shapes)
            if client.sheet is not None:
                self._wind.place(client.sheet)
        while client.poses.moved:
            name = client.poses.moved.pop()
            self.colliders.place(name, client.poses.present[name])
        if client.sheet is not None:
            self._wind.draw(client.wind, client.sheet)
