"""Interface of a cloth that can be published, such as `Cloth` and `LiveCloth`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from ..model.contact.collider import Collider
from ..model.grid import Array
from ..model.grippers.gripper import Gripper
from ..scene import Scene

Vector = tuple[float, float, float]


class PublishedCloth(Protocol):
    """A cloth whose present state can be published."""

    @property
    def scene(self) -> Scene:
        """The scene; its sheet has the grid that is published."""

    @property
    def air_velocity(self) -> Vector:
        """Velocity of the air now, gusts included, m/s."""

    @property
    def colliders(self) -> Mapping[str, Collider]:
        """Colliders by name."""

    @property
    def grippers(self) -> Mapping[str, Gripper]:
        """Grippers by name."""

    def write_positions(self, out: Array) -> None:
        """Write the position of every particle, m, to `out`, shape (rows, columns, 3)."""

    def write_particles(self, out: Array) -> None:
        """Write x y z vx vy vz of every particle, m and m/s, to `out`, (rows, columns, 6)."""
