"""
Integration methods, one per file.

A method is a class with

* a `name`, and the `order` of its global error;
* ``amplification(h, elastic, viscous)``, the matrix by which a step multiplies the position and
  velocity of a damped oscillator, and ``stable_step(elastic, viscous)``, the longest step that is
  stable on every oscillator up to these;
* ``accurate_step(scene)``, the longest step, s, that meets the scene's tolerance as far as
  that can be said beforehand;
* ``run(state, blocks, moved, watched)``, a generator that carries a `State` through blocks of
  substeps, see `Block`, and pauses after each.  Its `Dynamics` kicks and lets the particles
  drift; the method calls ``moved(h)`` when they have drifted for `h` s: after each drift of a
  block that is ``watched(block)``, so that whatever they meet on the way can act on them, and at
  the end of any other.

To add one, write its file and name its class here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Protocol

from .integrator import SubstepBatch
from .position_verlet import PositionVerlet

if TYPE_CHECKING:
    from ...scene import Scene
    from ..grid import Array
    from ..state import State
    from .kick_drift import KickDrift


class Integrator(Protocol):
    """What a method is."""

    name: str
    order: int

    def __init__(self, kick_drift: KickDrift) -> None: ...

    @staticmethod
    def amplification(h: float, elastic: float, viscous: float) -> Array:
        """Return the matrix of a step on ẍ = −λ x − μ ẋ, for (x, ẋ), shape (2, 2)."""
        ...

    @staticmethod
    def stable_step(elastic: float, viscous: float) -> float:
        """Return the longest stable step, s, for stiffness up to λ and damping up to μ."""
        ...

    @staticmethod
    def accurate_step(scene: Scene) -> float:
        """Return the longest step, s, that meets the tolerance of a scene."""
        ...

    def run(
        self,
        state: State,
        blocks: Iterable[SubstepBatch],
        moved: Callable[[float], None],
        watched: Callable[[SubstepBatch], bool],
    ) -> Iterator[None]:
        """Carry `state` through `blocks`."""
        ...


INTEGRATORS: dict[str, type[Integrator]] = {PositionVerlet.name: PositionVerlet}
