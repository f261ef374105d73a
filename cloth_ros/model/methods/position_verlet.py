"""
Position Verlet: half a drift, a kick, half a drift.

    x ← x + h/2 v,   v ← v + h a(x, v),   x ← x + h/2 v

Second order and symplectic (M. Tuckerman, B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992,
section II).  Velocity Verlet, half a kick, a drift, half a kick, is the same sequence begun at
another place.  This one needs no forces at the ends of an advance, so that n steps take n
evaluations of them: the two half drifts between neighbouring kicks are made as one.  That is the
price of symplectic Euler, to which it is conjugate and from which it has its stability and its
lasting energy.

Forces that depend on the velocity are what a kick has to integrate to second order at resting
positions.  Drag and air are (see `Dynamics.kick`); dashpots are taken at the velocity in the
middle of the kick (the explicit midpoint rule), which a second evaluation of the springs pays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..lattice import Array
from ..state import State

if TYPE_CHECKING:
    from ..dynamics import Dynamics


class PositionVerlet:
    """Position Verlet."""

    name = 'position_verlet'
    order = 2

    def __init__(self, dynamics: Dynamics) -> None:
        self._dynamics = dynamics

    @staticmethod
    def stable_step(elastic: float, viscous: float) -> float:
        """
        Return the longest stable step, s: h = 2/ω, and not more than 2/μ.

        The damping of the midpoint rule, 1 − h μ + (h μ)²/2, holds up to h μ = 2, and until then
        h² λ may be as large as (4 − 2 h μ + (h μ)²)/(1 − h μ/2), which is never below 4.

        Parameters
        ----------
        elastic, viscous
            Largest λ, 1/s², and μ, 1/s: stiffness and damping per unit mass.

        """
        return min(
            2 / math.sqrt(elastic) if elastic > 0 else math.inf,
            2 / viscous if viscous > 0 else math.inf,
        )

    @staticmethod
    def amplification(h: float, elastic: float, viscous: float) -> Array:
        """Return the matrix of a step on ẍ = −λ x − μ ẋ, for (x, ẋ), shape (2, 2)."""
        middle = 1 - 0.5 * h * viscous
        kick = np.array([[1, 0], [-h * middle * elastic, 1 - h * middle * viscous]])
        drift = np.array([[1, h], [0, 1]])
        step: Array = drift @ kick
        return step

    def run(
        self, state: State, steps: Iterable[float], move: Callable[[float], None]
    ) -> Iterator[None]:
        """Carry `state` through `steps`, s; velocities and positions meet again at the end."""
        before = 0.0
        for h in steps:
            move(0.5 * (before + h))
            self._kick(state, h)
            before = h
            yield
        move(0.5 * before)

    def _kick(self, state: State, h: float) -> None:
        dynamics = self._dynamics
        dynamics.accelerate(state)
        if dynamics.damped:
            start = state.velocity.copy()
            dynamics.kick(state, 0.5 * h)
            dynamics.accelerate(state)
            np.copyto(state.velocity, start)
        dynamics.kick(state, h)
