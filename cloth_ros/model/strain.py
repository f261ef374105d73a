"""
Stretch, shear and folding of a sheet, each measured apart from the others.

Stretch is the elongation between neighbours along rows and columns, as structural springs have it;
compression is not counted, because cloth folds instead.  Shear is the change of the right angle
between rows and columns: in a cell with edges a and b along both (means of opposite edges) and
diagonals c and d,

    sin γ = a · b / (|a| |b|) = (|c|² − |d|²) / (4 |a| |b|),

so it is what lengthens one shear spring of a cell and shortens the other.  (The strain of a shear
spring would contain the stretch as well.)  Folding is the angle between successive edges of a row
or a column, which shortens the bending spring across them: 0 in a flat sheet, π where it is folded
onto itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .grid import Array


class Strain(NamedTuple):
    """
    Largest deformations of a sheet.

    Attributes
    ----------
    stretch
        Largest elongation between neighbours along rows and columns, relative to the rest length;
        0 if none is longer.
    shear_angle
        Largest deviation of an angle between rows and columns from a right angle, rad.
    fold_angle
        Largest angle between successive edges along rows and columns, rad.

    """

    stretch: float
    shear_angle: float
    fold_angle: float


def _dot(first: Array, second: Array) -> Array:
    """Return the inner products of two fields of vectors, shape (3, rows, columns)."""
    total: Array = first[0] * second[0]
    for axis in (1, 2):
        total += first[axis] * second[axis]
    return total


def _cosines(products: Array, squares: Array, other_squares: Array) -> Array:
    """Return cosines from inner products and squared lengths; 1 where a vector has no length."""
    lengths = np.sqrt(squares * other_squares)
    if not lengths.all():
        nothing = lengths == 0
        products[nothing] = lengths[nothing] = 1.0
    products /= lengths
    return products


def _along(positions: Array, rest: float) -> tuple[Array, float, float]:
    """Return the edges along the last axis, their largest stretch and fold angle."""
    edges = positions[..., 1:] - positions[..., :-1]
    if not edges.size:
        return edges, 0.0, 0.0
    squares = _dot(edges, edges)
    stretch = max(math.sqrt(squares.max()) / rest - 1.0, 0.0)
    if edges.shape[-1] < 2:
        return edges, stretch, 0.0
    cosines = _cosines(_dot(edges[..., :-1], edges[..., 1:]), squares[..., :-1], squares[..., 1:])
    return edges, stretch, math.acos(min(max(float(cosines.min()), -1.0), 1.0))


def strain(positions: Array, spacing: tuple[float, float]) -> Strain:
    """
    Return the largest deformations of a sheet; 0 where it has no edges.

    Parameters
    ----------
    positions
        m, shape (3, rows, columns), double precision.
    spacing
        Rest length along the rows (x) and along the columns (y), m.

    """
    along, stretch_along, fold_along = _along(positions, spacing[0])
    across, stretch_across, fold_across = _along(positions.swapaxes(1, 2), spacing[1])
    across = across.swapaxes(1, 2)
    shear = 0.0
    if along.size and across.size:
        # Twice the mean edges of each cell.
        along = along[:, :-1] + along[:, 1:]
        across = across[..., :-1] + across[..., 1:]
        products = _dot(along, across)
        np.abs(products, out=products)
        lengths = np.sqrt(_dot(along, along) * _dot(across, across))
        np.maximum(lengths, products, out=lengths)  # rounding
        lengths[lengths == 0] = 1.0
        products /= lengths
        shear = math.asin(float(products.max()))
    return Strain(max(stretch_along, stretch_across), shear, max(fold_along, fold_across))
