"""The wind in the scene: an arrow above the sheet, with its speed."""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from .particles import Sheet
from .pose import Vector

_COLOUR = (18, 96, 150)
# Seconds of wind that the arrow represents, as in the markers of the node.
_SECONDS = 0.1
_LONGEST = 1.5  # m
_STILL = 1e-3  # m/s


def place_of_wind(sheet: Sheet) -> NDArray[np.float64]:
    """Return the place of the head of the arrow, m: above the sheet."""
    points = sheet.positions.reshape(-1, 3).astype(float)
    low, high = points.min(0), points.max(0)
    return np.array([*(low + high)[:2] / 2, high[2] + 0.2 * float((high - low).max())])


class WindView:
    """
    Draw the wind that was commanded last.

    The arrow stays above the place where the sheet was at the start: the wind may blow the sheet
    out of the picture.

    Parameters
    ----------
    scene
        Of the page.
    path
        Of the parent in the scene tree.

    """

    def __init__(self, scene: viser.SceneApi, path: str) -> None:
        points = np.zeros((1, 2, 3), np.float32)
        self._arrow = scene.add_arrows(
            f'{path}/wind', points, _COLOUR,
            shaft_radius=0.012, head_radius=0.032, head_length=0.08, visible=False,
        )  # fmt: skip
        self._label = scene.add_label(
            f'{path}/wind_speed', '', visible=False, anchor='bottom-center'
        )
        self._shown: Vector | None = None
        self._end: NDArray[np.float64] | None = None

    def place(self, sheet: Sheet) -> None:
        """Place the arrow above a sheet, at a start or a reset."""
        self._end, self._shown = place_of_wind(sheet), None

    def draw(self, wind: Vector, sheet: Sheet) -> None:
        """Draw the arrow along a velocity, m/s, if it has changed."""
        end = self._end = place_of_wind(sheet) if self._end is None else self._end
        if wind == self._shown:
            return
        self._shown = wind
        speed = math.hypot(*wind)
        self._arrow.visible = self._label.visible = speed > _STILL
        if speed <= _STILL:
            return
        start = end - np.array(wind) * min(_SECONDS, _LONGEST / speed)
        self._arrow.points = np.array([[start, end]], np.float32)
        self._label.text = f'wind {speed:.1f} m/s'
        self._label.position = (start + end) / 2 + (0.0, 0.0, 0.06)
