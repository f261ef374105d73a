"""Immutable copy of the state of contact."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ..grid import Array
from .rigid_collider import ColliderSnapshot


class ContactSnapshot(NamedTuple):
    """
    Everything about contact that later results depend on; see `Contact`.

    `known` are the colliders for which the blocks in reach are known, as long as particles do not
    move by more than `left`, m; see `ParticleBatch`.
    """

    colliders: Mapping[str, ColliderSnapshot]
    patience: int
    rho: Array
    elapsed: float
    moved: float
    # Absent in files that were written by earlier versions.
    excess: float = 0.0
    known: tuple[str, ...] = ()
    left: float = 0.0
