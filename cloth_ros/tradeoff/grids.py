"""
The same cloth on another grid.

What the cloth is made of stays: its mass, its size, and its stiffness as a sheet.  The structural
and shear stiffness of a square grid does not depend on the spacing d.  The bending springs act
on the second difference of the positions, which is the curvature times d², in a cell of area d²:
for the same resistance to bending their stiffness is scaled with 1/d².  (They are springs still:
they also resist stretching, and a curvature of a flat sheet only to higher order; the distance
of grids has that in it.)  Pins are moved to the particles nearest to where they were.
"""

from __future__ import annotations

import numpy as np

from ..model import Scene
from ..model.lattice import Array

# Particles along a side that a finer grid is not to exceed.
_MOST = 512


def on_grid(scene: Scene, factor: float) -> Scene | None:
    """
    Return the same cloth with its spacing divided by `factor`.

    A side of one particle stays one.  None if another one would have fewer than three particles,
    or too many.
    """
    sheet = scene.sheet
    sides = (sheet.rows, sheet.columns)
    rows, columns = (round((side - 1) * factor) + 1 for side in sides)
    if factor == 1:
        return scene
    long = [new for new, side in zip((rows, columns), sides, strict=True) if side > 1]
    if not long or min(long) < 3 or max(long) > _MOST:
        return None
    exact = (max(rows, columns) - 1) / (max(sides) - 1)
    return scene.with_parameters(
        {
            'sheet.rows': rows,
            'sheet.columns': columns,
            'springs.bending': scene.springs.bending * exact**2,
            'pins': _moved(scene.pinned(), rows, columns),
        }
    )


def _moved(pinned: Array, rows: int, columns: int) -> list[str]:
    """Return the pins of a grid of other size."""
    wanted = np.argwhere(pinned) / np.maximum(np.array(pinned.shape) - 1, 1)
    nearest = np.unique(np.rint(wanted * (rows - 1, columns - 1)).astype(int), axis=0)
    return [f'{row},{column}' for row, column in nearest] or ['']


def _resampled(positions: Array, axis: int, count: int) -> Array:
    """Return positions at `count` equally spaced places along an axis, linearly between."""
    place = np.linspace(0, positions.shape[axis] - 1, count)
    low = np.minimum(place.astype(int), max(positions.shape[axis] - 2, 0))
    high = np.minimum(low + 1, positions.shape[axis] - 1)
    shape = [1] * positions.ndim
    shape[axis] = count
    share = (place - low).reshape(shape)
    low_end, high_end = np.take(positions, low, axis), np.take(positions, high, axis)
    between: Array = (1 - share) * low_end + share * high_end
    return between


def sampled(positions: Array, rows: int, columns: int) -> Array:
    """
    Return where the particles of a coarser grid are on a finer one.

    Parameters
    ----------
    positions
        Of the finer grid, m, shape (samples, rows, columns, 3).
    rows, columns
        Of the coarser grid.

    """
    return _resampled(_resampled(positions, 1, rows), 2, columns)
