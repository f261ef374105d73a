"""
Symplectic Euler, damped by as much energy as it could gain.

    v₁ = s v + h a(x),   x₁ = x + h v₁,   s² = 1 − q,   q = h² λ < 1

With λ a bound of the stiffness per unit mass in *every* state, the potential per unit mass lies
below the parabola of curvature λ that touches it at x: it grows by at most −h a·v₁ + q v₁²/2.
With the kinetic energy, a step gains at most

    (1 + q) v₁²/2 − h a·v₁ − v²/2  =  −(q v − s h a)²/2  ≤  0.

So the total energy cannot grow, whatever the state: no other method here can promise that.  The
price is that the cloth moves as in honey, and that air and dashpots are left out.

The damping is a drag, s = e^(−γ h), which the kicks integrate: theirs is a little shorter than h,
g = (1 − s)/γ.  The gain is then at most the form

    (s² (1 + q) − 1) v²/2 + s ((1 + q) g − h) v·a + g ((1 + q) g − 2 h) a²/2,

which is never positive either, nor with more drag or with shorter steps (`test_guard.py`).
"""

from __future__ import annotations

import math

from .integrator import KickDriftIntegrator, Step, SubstepBatch


class DampedEuler(KickDriftIntegrator):
    """Symplectic Euler; its `Dynamics` must have the drag that `drag` says, or more."""

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

    def steps(self, block: SubstepBatch) -> tuple[Step, ...]:
        """Return the kicks and drifts of a block."""
        return (Step(block.h, block.h, 0),) * block.substeps
