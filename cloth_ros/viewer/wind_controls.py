"""Controls of the wind: speed and direction."""

from __future__ import annotations

import math
import time
from typing import Any

import viser

from .actions import Actions
from .cloth_client import MAX_WIND, ClothClient
from .pose import Vector

_GREATEST = 15.0  # m/s, of the slider
_USERS = 1.0  # s after the last movement by the user, in which the sliders are left alone


def wind_velocity(speed: float, azimuth: float, elevation: float) -> Vector | None:
    """
    Return the velocity of the air, m/s.

    Parameters
    ----------
    speed
        m/s.
    azimuth
        Where it blows to, degrees from x towards y.
    elevation
        Degrees upwards.

    Returns
    -------
    None if a number is not finite; speeds are limited to `MAX_WIND`.

    """
    if not all(map(math.isfinite, (speed, azimuth, elevation))):
        return None
    speed = min(max(speed, 0.0), MAX_WIND)
    turn, rise = math.radians(azimuth), math.radians(elevation)
    across = speed * math.cos(rise)
    return across * math.cos(turn), across * math.sin(turn), speed * math.sin(rise)


def wind_angles(velocity: Vector) -> tuple[float, float, float]:
    """Return speed, m/s, azimuth and elevation, degrees, of a velocity."""
    x, y, z = velocity
    speed = math.hypot(x, y, z)
    return speed, math.degrees(math.atan2(y, x)), math.degrees(math.atan2(z, math.hypot(x, y)))


class WindControls:
    """
    Sliders that publish the wind, and show what others publish.

    Parameters
    ----------
    gui
        Of the page.
    client
        The cloth.
    actions
        Take what the user does.

    """

    def __init__(self, gui: viser.GuiApi, client: ClothClient, actions: Actions) -> None:
        self._client = client
        self._shown: Vector | None = None
        self._moved = -_USERS
        self._sliders = (
            gui.add_slider(
                'speed, m/s', 0.0, _GREATEST, 0.1, 0.0,
                hint=f'velocity of the air, published on {client.name.resolve("wind")}',
            ),
            gui.add_slider(
                'direction, °', -180.0, 180.0, 5.0, 90.0,
                hint='where the wind blows to: 0 along x, 90 along y',
            ),
            gui.add_slider('upwards, °', -90.0, 90.0, 5.0, 0.0, hint='90: straight up'),
        )  # fmt: skip

        async def moved(event: viser.GuiEvent[Any]) -> None:
            if event.client is None:  # not by a user, but by `update`
                return
            velocity = wind_velocity(*(float(each.value) for each in self._sliders))
            if velocity is not None:
                actions.put((client.name, 'wind'), lambda: self._set(velocity))

        for slider in self._sliders:
            slider.on_update(moved)

    def _set(self, velocity: Vector) -> None:
        self._moved, self._shown = time.monotonic(), velocity
        self._client.set_wind(velocity)

    def update(self) -> None:
        """Show the wind that others have commanded."""
        wind = self._client.wind
        if wind == self._shown or time.monotonic() < self._moved + _USERS:
            return
        self._shown = wind
        speed, azimuth, elevation = wind_angles(wind)
        strength, direction, upwards = self._sliders
        strength.value = min(speed, _GREATEST)  # type: ignore[misc]
        if speed > 0:  # the direction of still air is kept
            direction.value, upwards.value = azimuth, elevation  # type: ignore[misc]
