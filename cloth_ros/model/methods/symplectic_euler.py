"""
Symplectic Euler: velocities first, then positions with the new velocities.

    v ← v + h a(x, v),   x ← x + h v

First order, one evaluation of the forces a step, and without damping it keeps a slightly changed
energy for all times (E. Hairer, C. Lubich, G. Wanner, "Geometric Numerical Integration", 2006,
theorem VI.3.3 and section IX.3).  It is position Verlet begun between two of its half drifts,
and so half a step out of time.
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


class SymplecticEuler:
    """Symplectic Euler."""

    name = 'symplectic_euler'
    order = 1

    def __init__(self, dynamics: Dynamics) -> None:
        self._dynamics = dynamics

    @staticmethod
    def stable_step(elastic: float, viscous: float) -> float:
        """
        Return the longest stable step, s.

        A mode of stiffness λ and damping μ turns over, z = −1, where h² λ + 2 h μ = 4; without
        damping that is h = 2/ω.

        Parameters
        ----------
        elastic, viscous
            Largest λ, 1/s², and μ, 1/s: stiffness and damping per unit mass.

        """
        if elastic == 0 and viscous == 0:
            return math.inf
        # The positive root, in the form that does not cancel for large μ.
        return 4 / (viscous + math.sqrt(viscous**2 + 4 * elastic))

    @staticmethod
    def amplification(h: float, elastic: float, viscous: float) -> Array:
        """Return the matrix of a step on ẍ = −λ x − μ ẋ, for (x, ẋ), shape (2, 2)."""
        kick = np.array([[1, 0], [-h * elastic, 1 - h * viscous]])
        drift = np.array([[1, h], [0, 1]])
        step: Array = drift @ kick
        return step

    def run(
        self, state: State, steps: Iterable[float], move: Callable[[float], None]
    ) -> Iterator[None]:
        """Carry `state` through `steps`, s."""
        for h in steps:
            self._dynamics.accelerate(state)
            self._dynamics.kick(state, h)
            move(h)
            yield
