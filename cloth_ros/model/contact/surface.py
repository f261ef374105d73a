"""Surface of a collider near the sheet, as its distance is computed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..grid import Array


class Surface(NamedTuple):
    """
    Surface of a collider at one time, see `distance.distance_from`.

    Attributes
    ----------
    kind, row, fields
        Kind of its shape, its numbers, and those of its mesh.
    rho
        Bound of the circumradius of the triangles of each particle, m, shape (size,).

    """

    kind: int
    row: Array
    fields: tuple[Array, Array, np.uint64]
    rho: Array
