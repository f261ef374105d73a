"""Blocks of substeps, which methods are given, and the kicks and drifts that they make of them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

from ..state import State

if TYPE_CHECKING:
    from .kick_drift import KickDrift


class SubstepBatch(NamedTuple):
    """
    Some substeps in a row, all of one length.

    Attributes
    ----------
    substeps
        How many.
    h
        Length of each, s.
    spacing
        Dissipation acts at least once in so many of them, an odd number.

    """

    substeps: int
    h: float
    spacing: int = 1


class Step(NamedTuple):
    """
    A kick, and the drift after it.

    Attributes
    ----------
    kick
        Duration of the kick, s; None: there is a drift alone.
    drift
        Duration of the drift, s.
    weight
        What the air and the dashpots are multiplied by in the kick; 0: they are left out.

    """

    kick: float | None
    drift: float
    weight: int = 1


class KickDriftIntegrator:
    """What all methods do alike that make their blocks of `steps`."""

    def __init__(self, kick_drift: KickDrift) -> None:
        self._kick_drift = kick_drift

    def steps(self, block: SubstepBatch) -> tuple[Step, ...]:
        """Return the kicks and drifts of a block."""
        raise NotImplementedError

    def run(
        self,
        state: State,
        blocks: Iterable[SubstepBatch],
        moved: Callable[[float], None],
        watched: Callable[[SubstepBatch], bool],
    ) -> Iterator[None]:
        """Carry `state` through `blocks`; see the package."""
        for block in blocks:
            steps = self.steps(block)
            if watched(block):
                for step in steps:
                    self._kick_drift.carry(state, (step,))
                    moved(step.drift)
            else:
                self._kick_drift.carry(state, steps)
                moved(block.substeps * block.h)
            yield


@functools.lru_cache(maxsize=256)
def plan(count: int, spacing: int) -> tuple[tuple[int, int], ...]:
    """
    Return when dissipation is to act in `count` substeps.

    Returns
    -------
    tuple of (int, int)
        A number of substeps without it, then one where it acts for so many (0: none).  Each of
        these stands in the middle of the substeps that it acts for.

    """
    parts, before = [], 0
    while count:
        weight = min(spacing, count)
        weight -= 1 - weight % 2
        half = weight // 2
        parts.append((before + half, weight))
        before, count = half, count - weight
    if before:
        parts.append((before, 0))
    return tuple(parts)
