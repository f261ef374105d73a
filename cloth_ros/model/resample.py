"""
Resampling: the same cloth on another grid.

Mass, size and the stiffness as a sheet stay the same.  The structural and shear stiffness of a
square grid does not depend on the spacing d.  The bending springs act on the second difference
of the positions, which is the curvature times d², in a cell of area d²: for the same resistance
to bending their stiffness is scaled with 1/d².  (They are springs all the same: they also resist
stretching, and resist the curvature of a flat sheet only to higher order; the difference between
grids includes that.)  Pins are moved to the nearest particles; on a finer grid, particles between
adjacent pins are pinned as well, so that an edge that is pinned stays so.  They are written as
slices, because there may be more of them than a scene takes strings.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from ..scene import Scene
from ..scene.parameter import MAX_LIST_LENGTH
from .grid import Array
from .kernels.jit import exact

# Most particles along a side of a finer grid.
_MOST = 512


def resample_scene(scene: Scene, factor: float) -> Scene | None:
    """
    Return the same cloth with its spacing divided by `factor`.

    A side of one particle stays one.  None if another one would have fewer than three particles,
    or too many, or if its pins are too irregular to be written.
    """
    sheet = scene.sheet
    sides = (sheet.rows, sheet.columns)
    rows, columns = (round((side - 1) * factor) + 1 for side in sides)
    if factor == 1:
        return scene
    long = [new for new, side in zip((rows, columns), sides, strict=True) if side > 1]
    if not long or min(long) < 3 or (factor > 1 and max(long) > _MOST):
        return None
    pins = _moved(scene.pinned(), rows, columns)
    if len(pins) > MAX_LIST_LENGTH:
        return None
    exact = (max(rows, columns) - 1) / (max(sides) - 1)
    return scene.with_parameters(
        {
            'sheet.rows': rows,
            'sheet.columns': columns,
            'springs.bending': scene.springs.bending * exact**2,
            'pins': pins,
        }
    )


def _moved(pinned: Array, rows: int, columns: int) -> list[str]:
    """Return the pins on a grid of another size; equal rows are written together."""
    wanted = np.argwhere(pinned) / np.maximum(np.array(pinned.shape) - 1, 1)
    moved = np.zeros((rows, columns), bool)
    moved[tuple(np.rint(wanted * (rows - 1, columns - 1)).astype(int).T)] = True
    (upper, lower), (left, right) = map(_around, pinned.shape, moved.shape)
    moved |= np.all([pinned[np.ix_(i, j)] for i in (upper, lower) for j in (left, right)], axis=0)
    alike: dict[bytes, list[int]] = {}
    for row in np.flatnonzero(moved.any(axis=1)).tolist():
        alike.setdefault(moved[row].tobytes(), []).append(row)
    return [
        f'{some_rows},{some_columns}'
        for same in alike.values()
        for some_columns in _slices(np.flatnonzero(moved[same[0]]).tolist())
        for some_rows in _slices(same)
    ] or ['']


def _around(count: int, other: int) -> tuple[Array, Array]:
    """Return, for each of `other` places along a side of `count`, the indices on both sides."""
    place = np.arange(other) * ((count - 1) / max(other - 1, 1))
    # A place at an index, but for rounding, has that on both sides.
    return np.floor(place + 1e-9).astype(int), np.ceil(place - 1e-9).astype(int)


def _slices(indices: list[int]) -> list[str]:
    """Return ascending indices as slices of equal steps, each as long as possible."""
    slices = []
    left = dict.fromkeys(indices)
    while left:
        first, second = (*islice(left, 2), indices[-1] + 1)[:2]
        end, step = first, second - first
        while end in left:
            del left[end]
            end += step
        slices.append(f'{first}:{end}:{step}' if end > second else f'{first}')
    return slices


@exact
def _interpolate(field, out):  # type: ignore[no-untyped-def]
    """Write a field, shape (samples, rows, columns, 3), on another grid to `out`, linearly."""
    samples, rows, columns, _ = field.shape
    for row in range(out.shape[1]):
        y = row * (rows - 1) / max(out.shape[1] - 1, 1)
        r = min(int(y), max(rows - 2, 0))
        below, down = min(r + 1, rows - 1), y - r
        for column in range(out.shape[2]):
            x = column * (columns - 1) / max(out.shape[2] - 1, 1)
            c = min(int(x), max(columns - 2, 0))
            beside, across = min(c + 1, columns - 1), x - c
            for n in range(samples):
                for axis in range(3):
                    upper = field[n, r, c, axis] * (1 - across)
                    upper += field[n, r, beside, axis] * across
                    lower = field[n, below, c, axis] * (1 - across)
                    lower += field[n, below, beside, axis] * across
                    out[n, row, column, axis] = upper * (1 - down) + lower * down


def interpolate(positions: Array, rows: int, columns: int) -> Array:
    """
    Return positions on another grid, by linear interpolation between those of one grid.

    Parameters
    ----------
    positions
        On the first grid, m, shape (samples, rows, columns, 3).
    rows, columns
        Of the other grid.

    """
    out: Array = np.empty((len(positions), rows, columns, 3))
    _interpolate(np.ascontiguousarray(positions, float), out)
    return out
