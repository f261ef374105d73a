"""Distances and offsets of all meshes of a scene, in the arrays that kernels take."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..grid import Array
from .rigid_collider import RigidCollider


class MeshFields:
    """
    Fields of meshes, one after the other.

    Parameters
    ----------
    colliders
        Of the scene, of any shape.
    dtype
        Precision of the sheet.

    Attributes
    ----------
    values, shares
        Distances, m, and offsets as shares of ρ, flat; not empty.
    starts
        Where those of each collider begin, by its name; 0 if it has none.

    """

    def __init__(self, colliders: Iterable[RigidCollider], dtype: type) -> None:
        values: list[Array] = [np.zeros(1)]
        shares: list[Array] = [np.zeros(1)]
        self.starts: dict[str, int] = {}
        length = 1
        for each in colliders:
            self.starts[each.name] = 0
            if each.shape.fields is not None:
                self.starts[each.name] = length
                values.append(each.shape.fields[0])
                shares.append(each.shape.fields[1])
                length += len(values[-1])
        self.values: Array = np.concatenate(values).astype(dtype)
        self.shares: Array = np.concatenate(shares).astype(dtype)

    def of(self, collider: RigidCollider) -> tuple[Array, Array]:
        """Return the fields of a collider."""
        start = self.starts[collider.name]
        return self.values[start:], self.shares[start:]
