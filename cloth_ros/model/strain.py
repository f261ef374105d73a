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
    total: Array = np.einsum('i...,i...->...', first, second)
    return total


def _cosines(first: Array, second: Array) -> Array:
    """Return the cosines of angles between vectors, shape (3, …); 1 where one has no length."""
    lengths = np.sqrt(_dot(first, first) * _dot(second, second))
    cosines: Array = np.ones_like(lengths)
    np.divide(_dot(first, second), lengths, out=cosines, where=lengths > 0)
    np.clip(cosines, -1.0, 1.0, out=cosines)
    return cosines


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
    stretch = fold = shear = 0.0
    edges = (np.diff(positions, axis=2), np.diff(positions, axis=1))
    before_and_after = (
        (edges[0][..., :-1], edges[0][..., 1:]),
        (edges[1][:, :-1], edges[1][:, 1:]),
    )
    for each, rest, (before, after) in zip(edges, spacing, before_and_after, strict=True):
        if each.size:
            longest = float(np.sqrt(_dot(each, each).max()))
            stretch = max(stretch, longest / rest - 1.0)
        if before.size:
            fold = max(fold, float(np.arccos(_cosines(before, after).min())))
    if edges[0].size and edges[1].size:
        along = edges[0][:, :-1] + edges[0][:, 1:]
        across = edges[1][..., :-1] + edges[1][..., 1:]
        lengths = np.sqrt(_dot(along, along) * _dot(across, across))
        sines = np.abs(_dot(along, across))
        np.divide(sines, lengths, out=sines, where=lengths > 0)
        shear = float(np.arcsin(min(float(sines.max()), 1.0)))
    return Strain(stretch, shear, fold)
