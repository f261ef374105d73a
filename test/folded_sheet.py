"""What a folded sheet covers of a table, and in how many layers: by the polygons of Shapely."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from self_intersection import sheet_triangles

Array = NDArray[Any]


def _shadows(positions: Array) -> Array:
    """Return the projections of the triangles along z, as polygons; none without an area."""
    rows, columns, _ = positions.shape
    corners = np.asarray(positions, float).reshape(-1, 3)[sheet_triangles(rows, columns), :2]
    polygons = shapely.polygons(corners)
    return polygons[shapely.is_valid(polygons)]


def covered(positions: Array) -> Any:
    """Return what a sheet covers of the plane z = 0, as a polygon; positions of (m, m, 3) in m."""
    return shapely.union_all(_shadows(positions))


def layers(positions: Array, distance: float = 0.002) -> Array:
    """Return how many triangles cover each point of a grid, m apart, that is covered at all."""
    tree = shapely.STRtree(_shadows(positions))
    low, high = np.min(positions, axis=(0, 1)), np.max(positions, axis=(0, 1))
    # Of no simple ratio to a grid of particles, whose edges would hold points of two triangles.
    x, y = (np.arange(low[k] + 0.377 * distance, high[k], distance) for k in (0, 1))
    points = shapely.points(*np.meshgrid(x, y)).ravel()
    point, _ = tree.query(points, predicate='intersects')
    counts = np.bincount(point, minlength=len(points))
    return counts[counts > 0]
