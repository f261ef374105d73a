"""What the kernel of kicks and drifts takes about contact in a batch of substeps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..grid import Array
from .particle_contact import ROW, SUMS


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
        1 where a block of particles is in reach, else 0: int64, shape (colliders, blocks).
    rho
        Bound of the circumradius of the triangles of each particle, m, shape (size,).
    mass
        Of each particle, in units of that of a cell; 0 for pinned ones and ghosts; shape (size,).
    values, shares, starts
        Distances and shares of all meshes, flat, and where those of each collider begin.
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
    sums: Array


def no_contacts(dtype: type) -> ContactTable:
    """Return a table without colliders, for a kernel that ignores contact."""
    none: Array = np.zeros(0, np.int64)
    real: Array = np.zeros(0, dtype)
    rows: Array = np.zeros((0, 0, ROW), dtype)
    sums, active = np.zeros((0, 0, SUMS)), np.zeros((0, 0), np.int64)
    return ContactTable(none, rows, active, real, real, real, real, none, sums)
