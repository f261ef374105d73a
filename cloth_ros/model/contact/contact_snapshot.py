"""Immutable copy of the state of contact."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ..grid import Array
from .rigid_collider import ColliderSnapshot


class ContactSnapshot(NamedTuple):
    """Everything about contact that later results depend on; see `Contact`."""

    colliders: Mapping[str, ColliderSnapshot]
    patience: int
    rho: Array
    elapsed: float
    moved: float
