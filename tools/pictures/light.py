"""
Soft light: the mean of many images, each with the shadows of one distant light.

The lights sample a sun of some width and the sky.  Objects reflect diffusely, so the sum is the light
that each point receives from what it sees of both, in linear intensities.  A shadowless light
stands for what the ground reflects.
"""

from __future__ import annotations

import numpy as np
import pyvista
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

Array = NDArray[np.float64]

GROUND_ALBEDO = 0.97
_SUN, _SKY, _FILL = 0.52, 0.40, 0.22  # share of the light; on open ground sun and sky are 0.92
_SUN_RADIUS = 0.10  # rad
_LOWEST = 0.22  # sine of the lowest elevation of the sky that is sampled
_FAR = 50.0  # m, of the lights from the focus; only their direction counts


def linear(colour: str) -> tuple[float, float, float]:
    """Return the linear intensities of a colour in sRGB."""
    values = np.array(to_rgb(colour))
    low, high = values / 12.92, ((values + 0.055) / 1.055) ** 2.4
    red, green, blue = np.where(values <= 0.04045, low, high).tolist()
    return red, green, blue


def _srgb(values: Array) -> NDArray[np.uint8]:
    """Return an image in sRGB from linear intensities."""
    values = np.clip(values, 0, 1)
    curve = np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
    return np.round(255 * curve).astype(np.uint8)


def _spiral(count: int) -> tuple[Array, Array]:
    """Return numbers in (0, 1), evenly spread, and angles of a sunflower, rad."""
    index = np.arange(count) + 0.5
    return index / count, np.pi * (1 + 5**0.5) * index


def sun_directions(towards: Array, count: int) -> Array:
    """Return unit vectors evenly within the disc of the sun, shape (count, 3)."""
    share, angle = _spiral(count)
    across = np.cross(towards, (0.0, 0.0, 1.0))
    across /= np.linalg.norm(across)
    other = np.cross(towards, across)
    offset = _SUN_RADIUS * np.sqrt(share)
    vectors = towards + np.outer(offset * np.cos(angle), across)
    vectors += np.outer(offset * np.sin(angle), other)
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def sky_directions(count: int) -> Array:
    """Return unit vectors evenly above the lowest elevation, shape (count, 3)."""
    share, angle = _spiral(count)
    height = _LOWEST + (1 - _LOWEST) * share
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)


def _subpixel(index: int) -> tuple[float, float]:
    """Return an offset within a pixel, which makes edges smooth in the mean (Halton 2, 3)."""
    offset = []
    for base in (2, 3):
        share, value, rest = 1.0, 0.0, index + 1
        while rest:
            share /= base
            value += share * (rest % base)
            rest //= base
        offset.append(value - 0.5)
    return offset[0], offset[1]


class SoftLight:
    """
    Renders a plotter that has no lights.

    Parameters
    ----------
    plotter
        With camera, objects and shadows disabled.
    towards_sun
        Unit vector.
    without_fill
        Actors that reflect no light of the ground, such as the ground itself.
    suns, skies
        Number of lights; more make shadows smoother.

    """

    def __init__(
        self,
        plotter: pyvista.Plotter,
        towards_sun: Array,
        without_fill: list[pyvista.Actor],
        suns: int,
        skies: int,
    ) -> None:
        self._plotter, self._without_fill = plotter, without_fill
        sun, sky = sun_directions(towards_sun, suns), sky_directions(skies)
        # Weights that make the light of each on open ground the wanted share.
        self._lights = [(each, _SUN / sun[:, 2].sum()) for each in sun]
        self._lights += [(each, _SKY / sky[:, 2].sum()) for each in sky]

    def _shoot(self, index: int) -> Array:
        """Return an image in intensities from 0 to 1, shifted within a pixel."""
        width, height = self._plotter.window_size
        x, y = _subpixel(index)
        self._plotter.camera.SetWindowCenter(2 * x / width, 2 * y / height)
        self._plotter.render()
        return self._plotter.screenshot(return_img=True).astype(float) / 255

    def _light(self, direction: Array) -> pyvista.Light:
        focus = np.array(self._plotter.camera.focal_point)
        return pyvista.Light(
            position=focus + _FAR * direction, focal_point=focus, light_type='scene light'
        )

    def render(self) -> NDArray[np.uint8]:
        """Return the image, shape (height, width, 3)."""
        plotter = self._plotter
        width, height = plotter.window_size
        total = np.zeros((height, width, 3))
        plotter.enable_shadows()
        for index, (direction, weight) in enumerate(self._lights):
            plotter.remove_all_lights()
            plotter.add_light(self._light(direction))
            plotter.set_background((GROUND_ALBEDO * direction[2],) * 3)
            total += weight * self._shoot(index)
        plotter.disable_shadows()
        total += _FILL * self._fill()
        return _srgb(total)

    def _fill(self) -> Array:
        """Return the light that the ground reflects, and some from the camera."""
        plotter = self._plotter
        for actor in self._without_fill:
            actor.visibility = False
        plotter.set_background((0.0, 0.0, 0.0))
        total = 0.0
        towards_camera = np.array(plotter.camera.position) - plotter.camera.focal_point
        directions = (towards_camera / np.linalg.norm(towards_camera), np.array([0.0, 0.0, -1.0]))
        for direction in directions:
            for index in range(4):
                plotter.remove_all_lights()
                plotter.add_light(self._light(direction))
                total = total + self._shoot(index) / 4
        for actor in self._without_fill:
            actor.visibility = True
        return total
