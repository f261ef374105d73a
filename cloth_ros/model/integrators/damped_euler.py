"""
Symplectic Euler with enough drag that the total energy cannot grow.

    v₁ = s v + h a(x),   x₁ = x + h v₁,   s² = 1 − q,   q = h² λ < 1

Let λ bound the stiffness per unit mass in *every* state.  The potential per unit mass then lies
below the parabola of curvature λ that touches it at x: it grows by at most −h a·v₁ + q v₁²/2.
With the kinetic energy, a step gains at most

    (1 + q) v₁²/2 − h a·v₁ − v²/2  =  −(q v − s h a)²/2  ≤  0.

So the total energy cannot grow in any state; no other method here guarantees that.  The price is
strong damping, and that air and dashpots are left out.

The damping is a drag, s = e^(−γ h), which `KickDrift` integrates: its gain is a little less than
h, g = (1 − s)/γ.  The energy gained is then at most the form

    (s² (1 + q) − 1) v²/2 + s ((1 + q) g − h) v·a + g ((1 + q) g − 2 h) a²/2,

which is never positive either, nor with more drag or with shorter steps (a test checks this).
"""

from __future__ import annotations

import math

from .integrator import Step, SubstepBatch


class DampedEuler:
    """Symplectic Euler; its `KickDrift` must have at least the drag that `drag` returns."""

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
    def steps(batch: SubstepBatch) -> tuple[Step, ...]:
        """Return the kicks and drifts of a batch, without dissipation other than drag."""
        return (Step(batch.h, batch.h, 0),) * batch.substeps
