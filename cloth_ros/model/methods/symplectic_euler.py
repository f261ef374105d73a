"""
Symplectic Euler: velocities first, then positions with the new velocities.

    v ← v + h a(x),   x ← x + h v

First order, one evaluation of the forces a step, and without damping it keeps a slightly changed
energy for all times (E. Hairer, C. Lubich, G. Wanner, "Geometric Numerical Integration", 2006,
theorem VI.3.3 and section IX.3).  Stable on an oscillator of frequency ω while h < 2/ω.  Its
trajectory is that of the leapfrog method, shifted in time by half a step.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..state import State, drift

if TYPE_CHECKING:
    from ..dynamics import Dynamics


class SymplecticEuler:
    """Symplectic Euler."""

    name = 'symplectic_euler'
    order = 1

    def __init__(self, dynamics: Dynamics) -> None:
        self._dynamics = dynamics

    def step(self, state: State, h: float) -> None:
        """Carry `state` forward by `h` seconds."""
        self._dynamics.accelerate(state)
        self._dynamics.kick(state, h)
        drift(state, h)
