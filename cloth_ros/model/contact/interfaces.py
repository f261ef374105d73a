"""What contact needs of an integrator, and of an observer of substeps."""

from __future__ import annotations

from typing import Any, Protocol

from ..inputs import Vector
from ..state import State
from .contact_table import ContactTable


class Observer(Protocol):
    """Receives every step, before and after contact."""

    def after_drift(self, state: State, step: Any, air_velocity: Vector) -> None:
        """Receive the state after a kick and a drift, before contact."""
        ...

    def after_contact(self, state: State, step: Any) -> None:
        """Receive the state after contact."""
        ...


class Kicks(Protocol):
    """Kicks and drifts of a scene, as far as contact is concerned."""

    def apply(
        self,
        state: State,
        steps: tuple[Any, ...],
        air_velocity: Vector,
        contacts: ContactTable | None = None,
    ) -> None:
        """Make the kicks and drifts of `steps`, with contact if any."""
        ...

    def mark(self) -> Any:
        """Return what `apply` changes besides the state."""
        ...

    def go_back(self, mark: Any) -> None:
        """Undo what was applied since `mark`, but for the state."""
        ...

    def resolve_contact(self, state: State, h: float, contacts: ContactTable) -> None:
        """Resolve the contact of a state that has just drifted for `h` s."""
        ...


class Drift(Protocol):
    """A step of an integrator, as far as contact is concerned."""

    @property
    def drift(self) -> float:
        """Duration of the drift, s."""
        ...
