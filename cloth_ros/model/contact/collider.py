"""A collider as seen by users of a cloth: a rigid body that moves as commanded."""

from __future__ import annotations

from typing import Protocol

from ...scene.collider import ColliderParameters
from ...scene.quaternion import Quaternion
from ..grid import Array
from ..inputs import Vector


class Collider(Protocol):
    """
    A collider, for reading.

    Attributes
    ----------
    name
        Unique in the scene.
    type
        'plane', 'sphere', 'box', 'capsule', 'cylinder' or 'mesh'.
    parameters
        From the scene.
    inset
        How far inside of its surface the sheet meets it, m: more than 0 while it grows, having
        been placed inside the sheet.
    max_penetration
        Greatest depth, m, of a triangle in the collider after the last substep, where it is above
        the tolerance.

    """

    name: str
    type: str
    parameters: ColliderParameters
    inset: float
    max_penetration: float

    @property
    def position(self) -> Vector:
        """Position of the origin in the world now, m."""
        ...

    @property
    def orientation(self) -> Quaternion:
        """Orientation in the world now, quaternion x y z w."""
        ...

    @property
    def touching(self) -> int:
        """Number of particles that touched it in the last substep."""
        ...

    @property
    def mesh_triangles(self) -> Array | None:
        """Triangles of a mesh in its own frame, m, shape (n, 3, 3); None for other types."""
        ...
