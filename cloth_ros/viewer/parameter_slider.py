"""A slider on the page that sets a number among the parameters of a node."""

from __future__ import annotations

import math
import time
from typing import Any, NamedTuple

import viser

from .actions import Actions
from .cloth_client import ClothClient
from .colour_scale import round_up

# s after the last movement by the user, in which the slider is left alone.
_USERS = 1.0


class Range(NamedTuple):
    """
    What a slider offers of a parameter.

    Attributes
    ----------
    name
        Of the parameter.
    text
        Shown on the page.
    least, greatest
        Values at the ends.  The greatest one of a linear slider is enlarged where needed.
    logarithmic
        True if the slider moves the exponent of a length in m.

    """

    name: str
    text: str
    least: float
    greatest: float
    logarithmic: bool = False

    def to_slider(self, value: float) -> float:
        """Return the position of the slider for a value."""
        if not self.logarithmic:
            return value
        return math.log10(min(max(value, self.least), self.greatest))

    def to_value(self, position: float) -> float | None:
        """Return the value for a position that the page has sent; None if it is not valid."""
        if not math.isfinite(position):
            return None
        value = position
        if self.logarithmic:
            value = float(f'{10.0 ** min(max(position, -9.0), 9.0):.1e}')
        return min(max(value, self.least), self.greatest)


def _length(metres: float) -> str:
    """Return a length as text with a unit that suits it."""
    factor, unit = next(
        (each for each in ((1.0, 'm'), (1e3, 'mm')) if metres * each[0] >= 0.1), (1e6, 'µm')
    )
    return f'{metres * factor:.3g} {unit}'


class ParameterSlider:
    """
    Show a parameter as a slider.

    Parameters
    ----------
    gui
        Of the page.
    client
        The cloth.
    actions
        Take what the user does.
    offered
        Parameter and range.

    """

    def __init__(
        self, gui: viser.GuiApi, client: ClothClient, actions: Actions, offered: Range
    ) -> None:
        self._client, self._range = client, offered
        self._moved = -_USERS
        value = float(client.parameters.values[offered.name])
        if not offered.logarithmic and value > 0:
            self._range = offered._replace(greatest=max(offered.greatest, round_up(2 * value)))
        shown = self._range
        low, high = shown.to_slider(shown.least), shown.to_slider(shown.greatest)
        self._slider = gui.add_slider(
            self._label(value),
            low,
            high,
            0.1 if shown.logarithmic else (high - low) / 200,
            min(max(shown.to_slider(value), low), high),
            marks=((low, _length(shown.least)), (high, _length(shown.greatest)))
            if shown.logarithmic
            else None,
        )

        async def moved(event: viser.GuiEvent[Any]) -> None:
            if event.client is None:  # not by a user, but by `update`
                return
            value = self._range.to_value(float(event.target.value))
            if value is not None:
                actions.put((client.name, 'set', shown.name), lambda: self._set(value))

        self._slider.on_update(moved)

    def _label(self, value: float) -> str:
        shown = self._range
        return f'{shown.text}: {_length(value)}' if shown.logarithmic else shown.text

    def _set(self, value: float) -> None:
        self._moved = time.monotonic()
        self._slider.label = self._label(value)
        self._client.parameters.set(self._range.name, value)

    def update(self) -> None:
        """Show the present value of the parameter, unless the user moves the slider."""
        value = self._client.parameters.values.get(self._range.name)
        if not isinstance(value, (int, float)) or time.monotonic() < self._moved + _USERS:
            return
        position = self._range.to_slider(float(value))
        if position > self._slider.max:
            self._range = self._range._replace(greatest=round_up(float(value)))
            self._slider.max = self._range.to_slider(self._range.greatest)
        if abs(position - self._slider.value) > 0.51 * self._slider.step:
            self._slider.value = max(position, self._slider.min)  # type: ignore[misc]
        self._slider.label = self._label(float(value))
        hint = self._client.parameters.descriptions.get(self._range.name)
        if hint and self._range.logarithmic:
            hint += '; the number beside the slider is the exponent of ten: -3 is 0.001 m'
        self._slider.hint = hint

    def remove(self) -> None:
        """Remove it from the page."""
        self._slider.remove()
