"""Interface of integrators: a batch of substeps as a sequence of kicks and drifts."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from ...scene import Scene
    from ..grid import Array


class SubstepBatch(NamedTuple):
    """
    Consecutive substeps of one length.

    Attributes
    ----------
    substeps
        Number of them.
    h
        Length of each, s.
    dissipation_interval
        Dissipation acts at least once in so many substeps, an odd number.

    """

    substeps: int
    h: float
    dissipation_interval: int = 1


class Step(NamedTuple):
    """
    A kick, and the drift after it.

    Attributes
    ----------
    kick
        Duration of the kick, s; None: a drift alone.
    drift
        Duration of the drift, s.
    weight
        Factor of air, dashpots and drag in the kick; 0: they are left out.

    """

    kick: float | None
    drift: float
    weight: int = 1


class Integrator(Protocol):
    """
    An explicit integration method.

    Attributes
    ----------
    name, order
        Name as in `solver.method`, and order of the global error.

    """

    name: str
    order: int

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
        """Return the longest step, s, that meets the tolerance of a scene, as a prediction."""
        ...

    @staticmethod
    def steps(batch: SubstepBatch) -> tuple[Step, ...]:
        """Return the kicks and drifts of a batch."""
        ...


@functools.lru_cache(maxsize=256)
def dissipation_schedule(count: int, interval: int) -> tuple[tuple[int, int], ...]:
    """
    Return in which of `count` substeps dissipation acts.

    Returns
    -------
    tuple of (int, int)
        A number of substeps without dissipation, then one where it acts for so many (0: none).
        Each of these is in the middle of the substeps for which it acts.

    """
    parts, before = [], 0
    while count:
        weight = min(interval, count)
        weight -= 1 - weight % 2
        half = weight // 2
        parts.append((before + half, weight))
        before, count = half, count - weight
    if before:
        parts.append((before, 0))
    return tuple(parts)
