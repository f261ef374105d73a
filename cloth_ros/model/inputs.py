"""External inputs of one advance: wind and the paths of colliders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Inputs:
    """
    Everything external that acts on a cloth during one advance.

    An advance is a function of a `Snapshot`, of these inputs and of its duration.

    Attributes
    ----------
    wind
        Commanded velocity of the air, m/s; gusts of the scene are added to it.
    collider_paths
        Waypoints, m, that a collider passes in this advance at constant speed, by the collider's
        name.  The last one is reached at the end; a collider without waypoints stands still.

    """

    wind: Vector = (0.0, 0.0, 0.0)
    collider_paths: Mapping[str, tuple[Vector, ...]] = field(default_factory=dict)
