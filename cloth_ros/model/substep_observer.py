"""Interface of what receives every substep of a simulation."""

from __future__ import annotations

from typing import Protocol

from .inputs import Vector
from .integrators.integrator import Step
from .state import State


class SubstepObserver(Protocol):
    """Receives every substep of a simulation."""

    def after_drift(self, state: State, step: Step, air_velocity: Vector) -> None:
        """Receive the state after a kick and a drift, before contact."""
        ...

    def after_contact(self, state: State, step: Step) -> None:
        """Receive the state after contact."""
        ...
