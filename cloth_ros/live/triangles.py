"""Corners of the triangles of a sheet, as a list that viewers draw."""

from __future__ import annotations

from ..model.grid import Array
from ..model.kernels.jit import exact


@exact
def _write_quads(positions, out):  # type: ignore[no-untyped-def]
    """Write the six corners of both triangles of every quad."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            for axis in range(3):
                right, down = positions[row, column + 1, axis], positions[row + 1, column, axis]
                out[row, column, axis] = positions[row, column, axis]
                out[row, column, 3 + axis] = right
                out[row, column, 6 + axis] = down
                out[row, column, 9 + axis] = positions[row + 1, column + 1, axis]
                out[row, column, 12 + axis] = down
                out[row, column, 15 + axis] = right


def write_triangles(positions: Array, out: Array) -> None:
    """
    Write the corners of two triangles for every cell of the grid; three times as fast as NumPy.

    Parameters
    ----------
    positions
        m, shape (rows, columns, 3), double precision.
    out
        Shape ((rows - 1) * (columns - 1), 6, 3), C-contiguous, double precision.

    """
    rows, columns, _ = positions.shape
    _write_quads(positions, out.reshape(rows - 1, columns - 1, 18))
