"""Colours of values: levels from 0 to a round greatest value."""

from __future__ import annotations

import math
from collections.abc import Sequence

# Twelve steps of viridis, whose lightness increases evenly: readable by the colour-blind, and
# without colours.
VIRIDIS: tuple[tuple[int, int, int], ...] = (
    (68, 1, 84), (72, 33, 115), (67, 62, 133), (56, 88, 140), (45, 112, 142), (37, 133, 142),
    (30, 155, 138), (42, 176, 127), (82, 197, 105), (134, 213, 73), (194, 223, 35), (253, 231, 37),
)  # fmt: skip
_STEPS = (1.0, 2.0, 5.0, 10.0)
_DECREASE_BELOW = 0.3  # share of the scale that the greatest value may fall to
_PATIENCE = 60  # states below it, before the scale becomes smaller


def round_up(value: float) -> float:
    """Return the least of 1, 2, 5 times a power of ten that is not below a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in _STEPS if step * power >= value * (1 - 1e-9))


class ColourScale:
    """
    Greatest value of a scale of colours that follows what is shown.

    It grows at once, and shrinks after some time only: a scale that changes often cannot be read.

    Parameters
    ----------
    least
        Least value of `greatest`, in the unit of the values.

    Attributes
    ----------
    greatest
        Value of the last colour.

    """

    def __init__(self, least: float) -> None:
        self.greatest = self._least = least
        self._below = 0
        self._largest_below = 0.0

    def follow(self, value: float) -> bool:
        """Take the greatest value of a state; return whether the scale has changed."""
        fitting = round_up(max(value, self._least))
        if fitting > self.greatest:
            self.greatest, self._below = fitting, 0
            return True
        if value > _DECREASE_BELOW * self.greatest:
            self._below = 0
            return False
        self._largest_below = max(value, self._largest_below if self._below else 0.0)
        self._below += 1
        if self._below < _PATIENCE:
            return False
        self._below = 0
        fitting = round_up(max(self._largest_below, self._least))
        changed = fitting < self.greatest
        self.greatest = fitting
        return changed


def legend(title: str, unit: str, greatest: float, colours: Sequence[tuple[int, int, int]]) -> str:
    """Return HTML that shows the colours of values from 0 to `greatest`, with the unit."""
    steps = ''.join(
        f'<span style="flex:1;background:rgb({red},{green},{blue})"></span>'
        for red, green, blue in colours
    )
    ticks = ''.join(
        f'<span>{share * greatest:g}{"" if share < 1 else " " + unit}</span>'
        for share in (0.0, 0.5, 1.0)
    )
    return (
        '<div style="padding:0 0.9em 0.3em;font-size:0.8em">'
        f'<div style="padding-bottom:0.2em">{title}</div>'
        f'<div style="display:flex;height:0.9em;border-radius:2px;overflow:hidden">{steps}</div>'
        f'<div style="display:flex;justify-content:space-between">{ticks}</div></div>'
    )
