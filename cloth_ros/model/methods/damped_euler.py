"""
Symplectic Euler, damped by as much energy as it could gain.

    v ← s v + h a(x),   x ← x + h v,   1 − s² ≥ h² λ,   h² λ < 1

With λ a bound of the stiffness per unit mass in *every* state, the potential lies below the
parabola of curvature m λ that touches it where the particles are.  So in a drift by h v it grows
by at most −m h a·v + ½ m h² λ v², of which the kick has taken the first term from the kinetic
energy already, and the damping takes the second.  The total energy cannot grow, whatever the
state: no other method here can promise that.  The price is that the cloth moves as in honey, and
that air and dashpots are left out.

The damping is that of a drag, s = e^(−γ h), which the kicks integrate.
"""

from __future__ import annotations

import math

from .position_verlet import PositionVerlet
from .steps import Block, Step


class DampedEuler(PositionVerlet):
    """Symplectic Euler; its `Dynamics` must have the drag that `drag` says."""

    name = 'damped_euler'
    order = 1

    @staticmethod
    def drag(h: float, elastic: float) -> float:
        """
        Return the rate γ, 1/s, of the drag that keeps energy from growing.

        Parameters
        ----------
        h
            Step, s; h² λ must be below 1.
        elastic
            Bound λ of the stiffness per unit mass, 1/s².

        """
        return -0.5 * math.log1p(-h * h * elastic) / h

    @staticmethod
    def steps(block: Block) -> tuple[Step, ...]:
        """Return the kicks and drifts of a block."""
        return (Step(block.h, block.h, 0),) * block.substeps
