"""Sheets that lie in layers, for tests and benchmarks of self-contact."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def folded(rows: int, columns: int, size: tuple[float, float], gap: float) -> Array:
    """
    Return a sheet that is folded once, round a half cylinder, without stretch.

    The fold is along y; the lower layer is at z = 0, and x begins at 0.

    Parameters
    ----------
    rows, columns, size
        Of the sheet; size in m.
    gap
        Distance of the layers, m.

    Returns
    -------
    Array
        Positions, m, shape (rows, columns, 3).

    """
    x = np.linspace(0.0, size[0], columns)
    radius = 0.5 * gap
    arc = np.pi * radius
    flat = 0.5 * (size[0] - arc)
    angle = np.clip((x - flat) / radius, 0.0, np.pi)
    positions = np.empty((rows, columns, 3))
    positions[..., 0] = np.where(x < flat + arc, np.minimum(x, flat), 2 * flat + arc - x)
    positions[..., 0] += radius * np.sin(angle)
    positions[..., 1] = np.linspace(-0.5, 0.5, rows)[:, None] * size[1]
    positions[..., 2] = radius * (1 - np.cos(angle))
    return positions


def twisted(rows: int, columns: int, size: tuple[float, float], turns: float) -> Array:
    """Return a strip that is twisted about its long axis, x, and compressed to half its length."""
    x = np.linspace(-0.5, 0.5, columns)
    across = np.linspace(-0.5, 0.5, rows)[:, None] * size[1]
    angle = 2 * np.pi * turns * (x + 0.5)
    positions = np.empty((rows, columns, 3))
    positions[..., 0] = 0.5 * size[0] * x
    positions[..., 1], positions[..., 2] = across * np.cos(angle), across * np.sin(angle)
    return positions


def folded_again(positions: Array, thickness: float) -> Array:
    """
    Return a folded sheet that lies on z = 0, folded once more, about an axis along x.

    Its highest parts are bent most, and keep twice the thickness, m, from each other.
    """
    x, y, z = np.moveaxis(positions, -1, 0)
    radius = z.max() + thickness
    middle = 0.5 * (y.min() + y.max())
    # Without stretch at the height of one thickness.
    flat = middle - 0.5 * np.pi * (radius - thickness)
    angle = np.clip((y - flat) / (radius - thickness), 0.0, np.pi)
    beyond = np.maximum(y - flat - np.pi * (radius - thickness), 0.0)
    around = np.minimum(y, flat) - beyond + (radius - z) * np.sin(angle)
    return np.stack([x, around, radius - (radius - z) * np.cos(angle)], axis=-1)
