"""
Position Verlet: half a drift, a kick, half a drift.

    x ← x + h/2 v,   v ← v + h a(x, v),   x ← x + h/2 v

Second order and symplectic (M. Tuckerman, B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992,
section II).  Velocity Verlet, half a kick, a drift, half a kick, is the same sequence from
another starting point.  Position Verlet needs no forces at the ends of an advance: n steps take n
evaluations, and the two half drifts between consecutive kicks are made as one.

`KickDrift` integrates velocity-dependent forces to second order within a kick.  In a batch of an
odd number of steps, dissipation may act in the middle one alone, for all of them: that is
symmetric, and so still of second order.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import numpy as np

from ..grid import Array
from ..stability import rate_bounds
from .dashpot_stages import REACH, stages_for
from .integrator import Step, SubstepBatch, dissipation_schedule

if TYPE_CHECKING:
    from ...scene import Scene

# Position error at the stability limit, as a share of the sheet's diagonal, as cloth_tradeoff
# measures it on the scenes of config/ where they are not chaotic.
_ERROR_AT_LIMIT = 2e-4


class PositionVerlet:
    """Position Verlet: drift, kick, drift."""

    name = 'position_verlet'
    order = 2

    @staticmethod
    def stable_step(elastic: float, viscous: float) -> float:
        """
        Return the longest stable step, s: h = 2/ω, and not more than the dashpots' stages reach.

        In the middle of a kick, Verlet's method conserves |v|² + xᵀ (K − h² K²/4) x, with the
        stiffness K per unit mass, which is positive below h = 2/ω.  Dashpots multiply v by P
        there, and so can only lower that.  It holds also where K and P have no modes in common.

        Parameters
        ----------
        elastic, viscous
            Largest λ, 1/s², and μ, 1/s: stiffness and damping per unit mass.

        """
        return min(
            2 / math.sqrt(elastic) if elastic > 0 else math.inf,
            REACH / viscous if viscous > 0 else math.inf,
        )

    @staticmethod
    def amplification(h: float, elastic: float, viscous: float) -> Array:
        """Return the matrix of a step on ẍ = −λ x − μ ẋ, for (x, ẋ), shape (2, 2)."""
        factor = stages_for(h * viscous).factor(h * viscous)
        kick = np.array([[1, 0], [-0.5 * h * (1 + factor) * elastic, factor]])
        drift = np.array([[1, h], [0, 1]])
        step: Array = drift @ kick
        return step

    @staticmethod
    def accurate_step(scene: Scene) -> float:
        """
        Return the step, s, whose error is about the tolerance.

        The error was measured at the stability limit, and is proportional to the step squared.
        """
        at_limit = _ERROR_AT_LIMIT * scene.sheet.diagonal
        if at_limit == 0:
            return math.inf
        limit = PositionVerlet.stable_step(*rate_bounds(scene))
        return limit * math.sqrt(scene.solver.tolerance / at_limit)

    @staticmethod
    def steps(batch: SubstepBatch) -> tuple[Step, ...]:
        """Return the kicks and drifts of a batch."""
        return _steps(*batch)


@functools.lru_cache(maxsize=64)
def _steps(count: int, h: float, dissipation_interval: int) -> tuple[Step, ...]:
    weights: list[int] = []
    for undamped, weight in dissipation_schedule(count, dissipation_interval):
        weights += [0] * undamped + [weight] * (weight > 0)
    drifts = [h] * (count - 1) + [0.5 * h]
    kicks = (Step(h, drift, weight) for drift, weight in zip(drifts, weights, strict=True))
    return (Step(None, 0.5 * h), *kicks)
