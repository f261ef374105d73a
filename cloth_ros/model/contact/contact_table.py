"""What the kernel of kicks and drifts takes about contact in a batch of substeps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..grid import Array
from .particle_contact import ROW, SUMS, TOTALS


class ContactTable(NamedTuple):
    """
    Colliders near the sheet, as `particle_contact.resolve_chunk` takes them.

    Attributes
    ----------
    kinds
        Of their shapes, int64, shape (colliders,).
    rows
        Numbers about each in each drift, or once if nothing changes: shape (drifts or 1,
        colliders, ROW).
    active
        `IN_REACH` or `IN_TOUCH` for blocks of particles, or 0, see `particle_contact`: int64,
        shape (colliders, blocks).
    rho
        Bound of the circumradius of the triangles of each particle, m, shape (size,).
    mass
        Of each particle, in units of that of a cell; 0 for pinned ones and ghosts; shape (size,).
    values, shares, starts
        Distances and shares of all meshes, flat, and where those of each collider begin.
    totals
        Sums over the particles at each place in a block, for the kernel itself: shape (chunks,
        TOTALS).
    sums
        Added to: shape (colliders, chunks, SUMS).

    """

    kinds: Array
    rows: Array
    active: Array
    rho: Array
    mass: Array
    values: Array
    shares: Array
    starts: Array
    totals: Array
    sums: Array

    def rows_from(self, drift: int) -> ContactTable:
        """Return the table without the rows of the drifts before one, if rows change."""
        return self._replace(rows=self.rows[drift:]) if len(self.rows) > 1 else self


def no_contacts(dtype: type) -> ContactTable:
    """Return a table without colliders, for a kernel that ignores contact."""
    none: Array = np.zeros(0, np.int64)
    real: Array = np.zeros(0, dtype)
    rows: Array = np.zeros((0, 0, ROW), dtype)
    sums, active = np.zeros((0, 0, SUMS)), np.zeros((0, 0), np.int64)
    totals: Array = np.zeros((0, TOTALS), dtype)
    return ContactTable(none, rows, active, real, real, real, real, none, totals, sums)
