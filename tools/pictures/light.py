"""
Soft light: the mean of many images, each with the shadows of one distant light.

The lights sample a sun of some width, the sky, and what the ground reflects from below.  Surfaces
reflect diffusely and intensities are linear, so the mean is the light that each point receives.
Objects get their shadows on each other from VTK's shadow maps.  Those on the ground are the
objects themselves, projected along the light: exact, and the ground has no edge.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pyvista
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from vtkmodules.vtkRenderingOpenGL2 import (
    vtkCameraPass,
    vtkRenderPassCollection,
    vtkSequencePass,
    vtkShadowMapPass,
)

Array = NDArray[np.float64]

_SUN, _SKY, _BOUNCE = 0.60, 0.36, 0.50  # light on a surface that faces up, or down
_SUN_RADIUS = 0.12  # rad
_LOWEST = 0.25  # sine of the lowest elevation of the sky that is sampled
_BOUNCES = 6
_SMOOTH = 16  # images of a mean without lights
_FAR = 50.0  # m, of the lights from the focus; only their direction counts
_TEXELS = 2048  # along the edge of a shadow map
_SHARPNESS = 80.0  # by which depth ends light; VTK's 11 lights what is near behind a surface
_NOTHING = (1.0, 0.0, 1.0)  # background that no object has the colour of


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
    offset = _SUN_RADIUS * np.sqrt(share)
    vectors = towards + np.outer(offset * np.cos(angle), across)
    vectors += np.outer(offset * np.sin(angle), np.cross(towards, across))
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


class Stage(NamedTuple):
    """
    What is lit; both plotters have the same camera, a square window and no lights.

    Attributes
    ----------
    objects
        Plotter of what stands on the ground or above it.
    ground
        Image of what is drawn on the ground, as `mean_image` returns it.
    shadow
        Plotter of `cast` alone, dark on white.
    cast
        Surface whose points are moved to the shadow.
    outline
        Points of the objects that cast it, m, shape (count, 3).
    height
        Of the ground, m.

    """

    objects: pyvista.Plotter
    ground: Array
    shadow: pyvista.Plotter
    cast: pyvista.PolyData
    outline: Array
    height: float


def _shoot(plotter: pyvista.Plotter, index: int) -> Array:
    """Return an image in intensities from 0 to 1, shifted within a pixel."""
    width, height = plotter.window_size
    x, y = _subpixel(index)
    plotter.camera.SetWindowCenter(2 * x / width, 2 * y / height)
    plotter.render()
    return np.asarray(plotter.screenshot(return_img=True), float) / 255


def mean_image(plotter: pyvista.Plotter) -> Array:
    """Return a smooth image of what needs no light, in intensities from 0 to 1."""
    images = [_shoot(plotter, index) for index in range(_SMOOTH)]
    return np.mean(images, axis=0)


def _shine(plotter: pyvista.Plotter, direction: Array) -> None:
    """Make a light from a direction the only one."""
    focus = np.array(plotter.camera.focal_point)
    plotter.remove_all_lights()
    plotter.add_light(
        pyvista.Light(
            position=focus + _FAR * direction, focal_point=focus, light_type='scene light'
        )
    )


def _shadow_pass() -> vtkCameraPass:
    """
    Return what draws objects with their shadows on each other.

    VTK takes the proportions of the window for those of the shadow map: it must be square.
    """
    shadows, passes = vtkShadowMapPass(), vtkRenderPassCollection()
    baker = shadows.GetShadowMapBakerPass()
    baker.SetResolution(_TEXELS)
    baker.SetExponentialConstant(_SHARPNESS)
    for each in (baker, shadows):
        passes.AddItem(each)
    sequence, camera = vtkSequencePass(), vtkCameraPass()
    sequence.SetPasses(passes)
    camera.SetDelegatePass(sequence)
    return camera


def _bounced(stage: Stage) -> Iterator[Array]:
    """Yield images of the objects in the light that the ground reflects."""
    directions = sky_directions(_BOUNCES) * (1.0, 1.0, -1.0)
    for index, direction in enumerate(directions):
        _shine(stage.objects, direction)
        yield _BOUNCE / -directions[:, 2].sum() * _shoot(stage.objects, index)


def render(stage: Stage, towards_sun: Array, suns: int, skies: int) -> NDArray[np.uint8]:
    """
    Return an image in sRGB, shape (height, width, 3).

    Parameters
    ----------
    stage
        Its plotters, of which those of objects and shadow are changed.
    towards_sun
        Unit vector.
    suns, skies
        Number of lights; more make shadows smoother.

    """
    sun, sky = sun_directions(towards_sun, suns), sky_directions(skies)
    # Weights with which sun and sky give open ground their share.
    lights = [(each, _SUN / sun[:, 2].sum()) for each in sun]
    lights += [(each, _SKY / sky[:, 2].sum()) for each in sky]
    stage.objects.set_background('black')
    bounced = sum(_bounced(stage))
    stage.objects.set_background(_NOTHING)
    shadow_pass = _shadow_pass()
    stage.objects.renderer.SetPass(shadow_pass)
    total = np.zeros_like(stage.ground)
    for index, (direction, weight) in enumerate(lights):
        _shine(stage.objects, direction)
        image = _shoot(stage.objects, index)
        behind = (image == _NOTHING).all(axis=-1, keepdims=True)
        points = stage.outline - np.outer(
            (stage.outline[:, 2] - stage.height) / direction[2], direction
        )
        stage.cast.points = points
        lit = weight * direction[2] * stage.ground * _shoot(stage.shadow, index)
        total += np.where(behind, lit, weight * image)
    shadow_pass.ReleaseGraphicsResources(stage.objects.render_window)
    return _srgb(total + bounced)
