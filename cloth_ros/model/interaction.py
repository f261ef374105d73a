"""Interface of what acts on the particles between substeps, such as colliders."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol

from ..scene import Scene
from .contact.sphere_collider import sphere_colliders
from .grid import Grid
from .inputs import Inputs
from .state import State


class Interaction(Protocol):
    """
    Acts on the particles after each drift: a collider, for example.

    `Simulation` knows this interface only.  It calls `begin_advance`, then `act` after each drift
    as long as `may_act` says so, else once for several substeps together, and `end_advance`.

    Attributes
    ----------
    name
        Unique in the scene.
    touched
        True if it has changed the state since the last `take_work`.

    """

    name: str
    touched: bool

    def begin_advance(self, state: State, time: float, seconds: float, inputs: Inputs) -> None:
        """Prepare for an advance of `seconds` from `time`, s."""
        ...

    def may_act(self, state: State, seconds: float) -> bool:
        """Return False if it cannot change the state within the next `seconds`."""
        ...

    def act(self, state: State, time: float, h: float) -> None:
        """Act on a state that has just drifted for `h` s, from `time`, s."""
        ...

    def take_work(self) -> float:
        """Return the most work, J, that it can have done since the last call; inf: unknown."""
        ...

    def end_advance(self) -> None:
        """Complete an advance."""
        ...

    def invalidate(self) -> None:
        """Discard what is cached about the state: positions or velocities were assigned."""
        ...

    def respawn(self, state: State) -> None:
        """Resolve a sudden overlap with the sheet: one of both was placed from outside."""
        ...

    def snapshot(self) -> Any:
        """Return an immutable value of everything that later results depend on."""
        ...

    def restore(self, snapshot: Any, state: State, *, exact: bool) -> None:
        """Return to a snapshot; not `exact`: of one with other parameters, or another sheet."""
        ...

    def warm_up(self, dtype: Any) -> None:
        """Compile the kernels for states of this precision."""
        ...


# Each makes the interactions of one kind that a scene has.  A new kind is one more entry.
_FACTORIES: tuple[Callable[[Scene, Grid], Iterable[Interaction]], ...] = (sphere_colliders,)


def build_interactions(scene: Scene, grid: Grid) -> list[Interaction]:
    """Return all interactions of a scene with its sheet, in the order in which they act."""
    return [interaction for factory in _FACTORIES for interaction in factory(scene, grid)]
