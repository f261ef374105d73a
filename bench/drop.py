"""
A free sheet that is dropped on a table or a box: geometry, and depth of penetration.

The same for every engine.  The sheet is the one of all benchmarks, 1 m × 1 m and 0.2 kg.  It
starts flat and at rest.  The table is the half-space below z = 0.  The box, a cube, has its upper
face at z = 0 and nothing below it; the sheet drapes over its edges.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]

SUPPORTS = ('table', 'box')
# Where the sheet starts, m above the support: it arrives with 1 m/s.
HEIGHT = 0.05
BOX_EDGE = 0.4
FRICTION = 0.3
# Positions along an edge of a triangle at which its depth is measured.
_SAMPLES = 7


def sample_triangles(positions: Array, samples: int = _SAMPLES) -> Array:
    """
    Return points of the triangles of a sheet.

    Parameters
    ----------
    positions
        Of the particles, m, shape (rows, columns, 3).  Each cell is two triangles; their common
        side joins the corner of lowest row and column with the opposite one.
    samples
        Points on each side of a triangle; its corners are the first and the last.

    Returns
    -------
    Array
        m, shape (points, 3).

    """
    steps = np.linspace(0, 1, samples)
    down, across = np.meshgrid(steps, steps, indexing='ij')
    corner, beside = positions[:-1, :-1], positions[:-1, 1:]
    below, opposite = positions[1:, :-1], positions[1:, 1:]
    upper, lower = across >= down, down >= across
    points = [
        corner[..., None, :] * (1 - first)[:, None]
        + middle[..., None, :] * (first - second)[:, None]
        + opposite[..., None, :] * second[:, None]
        for middle, first, second in (
            (beside, across[upper], down[upper]),
            (below, down[lower], across[lower]),
        )
    ]
    return np.concatenate([each.reshape(-1, 3) for each in points])


def depth(positions: Array, support: str) -> float:
    """
    Return the largest depth of the sheet's triangles in the table or box, m; 0 if they touch none.

    The depth of a point inside is its distance to the nearest point of the surface.  The support
    is the true one, without the thickness that an engine gives it or the sheet.

    Parameters
    ----------
    positions
        Of the particles, m, shape (rows, columns, 3).
    support
        One of `SUPPORTS`.

    """
    points = sample_triangles(np.asarray(positions, float))
    if support == 'table':
        return max(0.0, float(-points[:, 2].min()))
    points[:, 2] += BOX_EDGE / 2
    inside = BOX_EDGE / 2 - np.abs(points).max(axis=-1)
    return max(0.0, float(inside.max()))


def is_held(positions: Array) -> bool:
    """Return whether the sheet is finite, and its centre of mass above the box's lower face."""
    return bool(np.isfinite(positions).all() and positions[..., 2].mean() > -BOX_EDGE)


def largest_stretch(positions: Array) -> float:
    """Return the largest elongation between neighbours along rows and columns, as a strain."""
    rest = 1 / (len(positions) - 1)
    along = np.linalg.norm(np.diff(positions, axis=0), axis=-1)
    across = np.linalg.norm(np.diff(positions, axis=1), axis=-1)
    return float(max(along.max(), across.max()) / rest - 1)
