"""Interface of colliders: rigid bodies that move as commanded, unaffected by the cloth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from ..grid import Array
from ..inputs import Inputs, Vector
from ..state import State


@runtime_checkable
class Collider(Protocol):
    """
    A collider, as seen by users of a cloth; it is also an `interaction.Interaction`.

    Attributes
    ----------
    name
        Unique in the scene.
    shape
        'sphere', 'box' or 'cylinder'.
    initial_position
        Position parameter of the scene, m.
    orientation
        Quaternion x y z w.
    max_penetration
        Greatest depth, m, of a triangle in the collider after the last substep, where it is above
        the tolerance.

    """

    name: str
    shape: str
    initial_position: Vector
    max_penetration: float
    orientation: tuple[float, float, float, float]

    @property
    def position(self) -> Vector:
        """Position in the world now, m."""
        ...

    @property
    def size(self) -> Vector:
        """Lengths along the axes of the collider now, m."""
        ...

    def checked_target(self, position: Sequence[float], sheet: Array) -> Vector:
        """Return a commanded position, m, near a sheet at `sheet`, m; raises ValueError."""
        ...

    def contact_possible(self, state: State, seconds: float, inputs: Inputs) -> bool:
        """Return False if no contact is possible within `seconds`; compiles no kernel."""
        ...
