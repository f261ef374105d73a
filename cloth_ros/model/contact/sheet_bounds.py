"""Size of the triangles of a sheet, predicted for a short time."""

from __future__ import annotations

import numpy as np

from ..grid import GHOST_DISTANCE_SQUARED
from ..kernels.jit import inlined, kernel
from .minimum import least

# Factor on the longest edge: velocities change in a batch, and a small motion is not followed.
_MARGIN = 1.03
# Times, s, in which a bound decreases to the size of the triangles, and in which it may double.
_MEMORY, _RISE = 1.0, 1.0


@inlined
def _longer(longest, position, i, j, ghost):  # type: ignore[no-untyped-def]
    """Return the larger of `longest` and the square of an edge; that to a ghost does not count."""
    x = position[0, i] - position[0, j]
    y = position[1, i] - position[1, j]
    z = position[2, i] - position[2, j]
    squared = x * x + y * y + z * z
    return longest if squared > ghost else max(longest, squared)


@inlined
def longest_edges(position, first, last, row, cells):  # type: ignore[no-untyped-def]
    """Write the squared longest edge or diagonal of the cells that begin at some particles."""
    zero, ghost = position.dtype.type(0), position.dtype.type(GHOST_DISTANCE_SQUARED)
    one = np.uint64(1)
    for i in range(first, last):
        right, below, across = i + one, i + row, i + row + one
        longest = _longer(zero, position, i, right, ghost)
        longest = _longer(longest, position, i, below, ghost)
        longest = _longer(longest, position, i, across, ghost)
        longest = _longer(longest, position, right, below, ghost)
        longest = _longer(longest, position, right, across, ghost)
        cells[i] = _longer(longest, position, below, across, ghost)


@inlined
def _stretched(longest, position, velocity, i, j, seconds, ghost):  # type: ignore[no-untyped-def]
    """Return the larger of `longest` and the squares of an edge now and in `seconds`."""
    x = position[0, i] - position[0, j]
    y = position[1, i] - position[1, j]
    z = position[2, i] - position[2, j]
    squared = x * x + y * y + z * z
    x += seconds * (velocity[0, i] - velocity[0, j])
    y += seconds * (velocity[1, i] - velocity[1, j])
    z += seconds * (velocity[2, i] - velocity[2, j])
    longest = longest if squared > ghost else max(longest, squared)
    return longest if squared > ghost else max(longest, x * x + y * y + z * z)


@kernel
def measure_triangles(  # type: ignore[no-untyped-def]
    position, velocity, begin, end, stride, elapsed, seconds, least_rho, most_rho, cells, rho
):
    """
    Bound for each particle the circumradius of its triangles, m.

    A cell is taken as four triangles, by both diagonals.  As long as it is about a parallelogram,
    each lies in a circle around half of its longest edge or diagonal.

    Parameters
    ----------
    position, velocity, begin, end, stride
        Of the sheet, as in `Grid` and `State`.
    elapsed, seconds
        Time since the last call, and time for which sizes are predicted, s.
    least_rho, most_rho
        Of the bound, m.
    cells
        Receives the squared longest edge of the cell that begins at a particle, shape (size,).
    rho
        The bound, shape (size,).  It changes slowly: a surface that trembled with the sheet would
        shake it.  Where triangles grow faster, it is no bound, and `has_grown` will tell.

    Returns
    -------
    float
        By how much triangles are larger than the bound says, m.

    """
    number = position.dtype.type
    zero, ghost, t = number(0), number(GHOST_DISTANCE_SQUARED), number(seconds)
    half, kept = number(0.5 * _MARGIN), number(max(1.0 - elapsed / _MEMORY, 0.0))
    floor, ceiling = number(least_rho), number(most_rho)
    rise = number(least_rho * elapsed / _RISE)
    row, one = np.uint64(stride), np.uint64(1)
    first, last = np.uint64(begin), np.uint64(end)
    margins = np.empty(end - begin, position.dtype)
    for i in range(first - row - one, last):
        right, below, across = i + one, i + row, i + row + one
        longest = _stretched(zero, position, velocity, i, right, t, ghost)
        longest = _stretched(longest, position, velocity, i, below, t, ghost)
        longest = _stretched(longest, position, velocity, i, across, t, ghost)
        longest = _stretched(longest, position, velocity, right, below, t, ghost)
        longest = _stretched(longest, position, velocity, right, across, t, ghost)
        cells[i] = _stretched(longest, position, velocity, below, across, t, ghost)
    for i in range(first, last):
        squared = max(max(cells[i], cells[i - one]), max(cells[i - row], cells[i - row - one]))
        now = max(rho[i], floor)
        largest = half * np.sqrt(squared)
        wanted = min(largest, ceiling)
        rho[i] = max(min(max(wanted, kept * now), now + rise), floor)
        margins[i - first] = rho[i] - largest
    return -least(margins, zero)
