"""Place camera, ground, scale bar and light for frames of one scene, and render them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pyvista
from numpy.typing import NDArray

from cloth_ros import Scene

from .capture import Frame
from .drawing import add_frame, add_ground_lines, add_scale_bar, extent
from .light import Stage, mean_image, render
from .moments import View

Array = NDArray[np.float64]

_ANGLE = 24.0  # degrees, vertical field of view
_MARGIN = 1.16  # what the picture is larger than its contents
_SUN_ABOVE = 48.0  # degrees above the ground
_CLEARANCE = 0.06  # of the largest edge of the sheet, from the lowest point to the ground
_SHADOW = (0.12,) * 3  # light on the ground where a light is blocked, from all around
_BAR_LENGTHS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)  # m
_BAR_SHARE = 0.5  # greatest length of the bar / edge of the sheet


def _direction(azimuth: float, elevation: float) -> Array:
    """Return a unit vector from angles in degrees."""
    a, e = np.radians((azimuth, elevation))
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


class Studio:
    """
    Renders frames of one scene from one place.

    Parameters
    ----------
    scene
        Its sheet decides the weave and the scale; its planes are drawn as the ground.
    view
        Direction of the camera, and the ground.
    frames
        All of them are within the picture.
    window
        Width and height in pixels.

    """

    def __init__(
        self, scene: Scene, view: View, frames: Sequence[Frame], window: tuple[int, int]
    ) -> None:
        self._scene, self._view, self._window = scene, view, window
        self._planes = [each.name for each in scene.colliders if each.type == 'plane']
        points = np.concatenate([extent(frame, self._planes) for frame in frames])
        edge = max(scene.sheet.size)
        lowest = points[:, 2].min() - _CLEARANCE * edge
        self._ground = lowest if view.ground is None else view.ground
        self._towards = _direction(view.azimuth, view.elevation)
        self._right = _direction(view.azimuth + 90, 0)
        fitting = [each for each in _BAR_LENGTHS if each <= _BAR_SHARE * edge]
        self._bar_length = fitting[-1] if fitting else _BAR_LENGTHS[0]
        self._bar_centre = self._in_front(points)
        half = self._bar_length / 2 * self._right
        text = 0.2 * self._bar_length * _direction(view.azimuth, 0)
        bar = [self._bar_centre + sign * half + text for sign in (-1, 1)]
        self._place_camera(np.vstack([points, *bar]))
        self._centre = np.append(points[:, :2].mean(axis=0), self._ground)
        self._radius = 1.4 * float(np.linalg.norm(np.ptp(points, axis=0)))

    def _in_front(self, points: Array) -> Array:
        """Return a place on the ground between the scene and the camera, at the right."""
        towards = _direction(self._view.azimuth, 0)
        depth = (points @ towards).max() + 0.5 * self._bar_length
        beside = (points @ self._right).max() - self._bar_length / 2
        return depth * towards + beside * self._right + (0.0, 0.0, self._ground)

    def _place_camera(self, points: Array) -> None:
        """Find the focus and the distance at which the points fill the picture."""
        up = np.cross(self._towards, self._right)
        axes = np.stack([self._right, up, self._towards])
        local = points @ axes.T
        half = np.tan(np.radians(_ANGLE / 2)) / _MARGIN
        halves = half * np.array([self._window[0] / self._window[1], 1.0])
        centre = (local.max(axis=0) + local.min(axis=0)) / 2
        for _ in range(20):  # perspective: the nearest points count most
            away = local - centre
            distance = float((away[:, 2] + (np.abs(away[:, :2]) / halves).max(axis=1)).max())
            seen = away[:, :2] / (distance - away[:, 2:])
            centre[:2] += distance * (seen.max(axis=0) + seen.min(axis=0)) / 2
        self._focus = centre @ axes
        self._eye = self._focus + distance * self._towards

    def _plotter(self, colour: str = 'white') -> pyvista.Plotter:
        width, height = self._window
        square = (max(self._window),) * 2  # which shadows need; the rest is cut off
        plotter = pyvista.Plotter(off_screen=True, window_size=square, lighting='none')
        plotter.disable_anti_aliasing()
        plotter.set_background(colour)
        plotter.camera.position, plotter.camera.focal_point = self._eye, self._focus
        half = np.tan(np.radians(_ANGLE / 2)) * max(width, height) / height
        plotter.camera.up = (0, 0, 1)
        plotter.camera.view_angle = np.degrees(2 * np.arctan(half))
        return plotter

    def _ground_image(self) -> Array:
        """Return lines and scale bar on the ground, the same for all frames."""
        plotter = self._plotter()
        add_ground_lines(plotter, self._centre, self._radius)
        add_scale_bar(plotter, self._bar_centre, self._right, self._bar_length)
        image = mean_image(plotter)
        plotter.close()
        return image

    def _stage(self, frame: Frame, ground: Array) -> Stage:
        """Return what is lit of a frame."""
        objects, shadow = self._plotter(), self._plotter()
        meshes = add_frame(objects, frame, self._scene.sheet.size, self._planes)
        cast = pyvista.merge(meshes).extract_surface(algorithm='dataset_surface').triangulate()
        shadow.add_mesh(cast, color=_SHADOW, lighting=False)
        outline = np.asarray(cast.points, float).copy()
        return Stage(objects, ground, shadow, cast, outline, self._ground)

    def images(
        self, frames: Sequence[Frame], suns: int, skies: int
    ) -> Iterator[NDArray[np.uint8]]:
        """Yield an image of each frame, shape (height, width, 3), in sRGB."""
        sun = _direction(self._view.azimuth + self._view.sun, _SUN_ABOVE)
        ground = self._ground_image()
        for frame in frames:
            stage = self._stage(frame, ground)
            square = render(stage, sun, suns, skies)
            top, left = (len(square) - self._window[1]) // 2, (len(square) - self._window[0]) // 2
            yield square[top : top + self._window[1], left : left + self._window[0]]
            for plotter in (stage.objects, stage.shadow):
                plotter.close()
