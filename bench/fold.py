"""A free sheet that is folded once, and falls on itself: its start, the same for every engine."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from .layers import folded

# Distance at which layers rest, m.
THICKNESS = 0.005
# m: distance of the halves at the start, and height of the lower one, which rests.
_GAP, _HEIGHT = 0.1, THICKNESS / 2


def start(size: int) -> NDArray[Any]:
    """Return the positions at the start, without stretch, m, shape (size, size, 3)."""
    positions = folded(size, size, (1.0, 1.0), _GAP)
    positions[..., 0] -= 0.25
    positions[..., 2] += _HEIGHT
    return positions
