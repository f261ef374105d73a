"""
Memory layout of a sheet: flat arrays of its particles with a ring of ghost particles.

A field of the sheet (positions, velocities, …) is one C-contiguous array of shape
(3, size), one row per coordinate.  Particle (row, column) has the flat index
``begin + row * stride + column``, and ``stride`` is ``columns + 2``: the two ghosts behind each
row serve as the right neighbours of that row and as the left neighbours of the next.  Two rows
of ghosts precede the sheet and two follow it.  So every neighbour that a spring can reach is at a
constant offset, a kernel is one flat loop without a branch, and the compiler vectorises it.

More ghosts at the end fill the last vector: the scalar remainder of a vectorised loop rounds
differently, and the two ends of a spring would not feel the same force.

Ghosts are `GHOST` away from everything, so that a kernel masks their springs by the distance.
They never move, because nothing accelerates them.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.parameter import invalid_value_error
from ..scene.quaternion import rotation_matrix

Array = NDArray[Any]

# Far enough to tell from any cloth, and its square still fits in single precision.
GHOST = 1e18
# Squared distance, m², beyond which a neighbour is a ghost.
GHOST_DISTANCE_SQUARED = 1e30
# Particles in one iteration of an unrolled vector loop: vectors of 16, four at a time.
_UNROLLED = 64
# Largest coordinate, m or m/s, that is taken from outside.
_LARGEST = 1e9


@dataclass(frozen=True)
class Grid:
    """Flat indices of the particles of a sheet of `rows` × `columns`."""

    rows: int
    columns: int

    @property
    def stride(self) -> int:
        """Flat distance from one row to the next."""
        return self.columns + 2

    @property
    def begin(self) -> int:
        """Flat index of particle (0, 0)."""
        return 2 * self.stride

    @property
    def end(self) -> int:
        """Flat index after the last particle and the ghosts that fill its vector."""
        count = self.rows * self.stride - 2
        return self.begin + -(-count // _UNROLLED) * _UNROLLED

    @property
    def size(self) -> int:
        """Length of a flat array, ghosts included."""
        return (self.rows + 4) * self.stride + _UNROLLED

    @property
    def tributary_areas(self) -> Array:
        """
        Share of a cell's area that belongs to each particle, shape (rows, columns).

        1 inside, 1/2 at an edge and 1/4 at a corner: mass and air are those of the same continuous
        sheet on every grid, to second order in the spacing.
        """
        return np.outer(tributary_lengths(self.rows), tributary_lengths(self.columns))

    def field(self, dtype: Any, fill: float = 0.0, components: int = 3) -> Array:
        """Return a new flat array, shape (components, size), filled with `fill`."""
        return np.full((components, self.size), fill, dtype)

    @property
    def flat_indices(self) -> Array:
        """Flat index of each particle, row by row: int64, shape (rows * columns,)."""
        rows, columns = np.divmod(np.arange(self.rows * self.columns), self.columns)
        result: Array = self.begin + rows * self.stride + columns
        return result

    def interior(self, flat: Array) -> Array:
        """Return the view of the particles of a flat array, shape (..., rows, columns)."""
        shape = (*flat.shape[:-1], self.rows + 4, self.stride)
        # Splitting an axis makes a view, not a copy.
        return flat[..., :-_UNROLLED].reshape(shape)[..., 2:-2, : self.columns]

    def checked(self, name: str, value: Array) -> Array:
        """
        Return a user's field, shape (rows, columns, 3), as one of shape (3, rows, columns).

        Raises
        ------
        ValueError
            It has another shape, or is not finite and moderate everywhere.

        """
        shape = (self.rows, self.columns, 3)
        copy = f'change a copy: cloth.{name}.copy()'
        try:
            with warnings.catch_warnings():
                warnings.simplefilter('ignore')  # masked numbers become NaN; refused below
                given = np.asarray(value)
        except (TypeError, ValueError, OverflowError):  # lists of unequal lengths, say
            raise invalid_value_error(name, value, f'an array of shape {shape}', copy) from None
        if given.shape != shape:
            raise invalid_value_error(f'the shape of {name}', given.shape, str(shape), copy)
        if given.dtype.kind not in 'fiu':  # not strings and objects, that NumPy would convert
            raise invalid_value_error(
                f'the type of {name}', str(given.dtype), 'real numbers', copy
            )
        with np.errstate(over='ignore'):  # of numbers that no double holds; refused below
            array = given.astype(float)
        if not np.all(np.abs(array) <= _LARGEST):  # False for NaN
            wrong = float(array[~(np.abs(array) <= _LARGEST)][0])
            raise invalid_value_error(
                name, wrong, f'finite and at most {_LARGEST:g} everywhere', copy
            )
        return np.moveaxis(array, -1, 0)


def tributary_lengths(count: int) -> Array:
    """Return the share of the spacing that belongs to each particle of a row, shape (count,)."""
    lengths = np.ones(count)
    if count > 1:
        lengths[[0, -1]] = 0.5
    return lengths


def to_grid_copy(array: Array) -> Array:
    """Return a read-only copy, shape (rows, columns, 3), of a field (3, rows, columns)."""
    copy: Array = np.ascontiguousarray(np.moveaxis(array, 0, -1))
    copy.flags.writeable = False  # a write to the copy would have no effect
    return copy


def flat_sheet(
    rows: int, columns: int, spacing: tuple[float, float], quaternion: tuple[float, ...]
) -> Array:
    """
    Return the undeformed sheet about its centre, m, shape (3, rows, columns).

    Unrotated, columns run along +x, rows along +y, and the normal points along +z.
    """
    x = (np.arange(columns) - (columns - 1) / 2) * spacing[0]
    y = (np.arange(rows) - (rows - 1) / 2) * spacing[1]
    plane = np.zeros((3, rows, columns))
    plane[0], plane[1] = np.meshgrid(x, y)
    return np.tensordot(rotation_matrix(quaternion), plane, axes=1)
