"""
Verlet with staggered kicks: structural springs, and half a step later the others.

    v ← v + h/2 a₁(x),   x ← x + h/2 v,   v ← v + h a₂(x),   x ← x + h/2 v,   v ← v + h/2 a₁(x)

a₁ are the accelerations by structural springs and gravity, a₂ those by shear and bending springs.
The two half kicks between consecutive steps are made as one: n steps take n evaluations of a₂ and
n + 1 of a₁.  Second order, symmetric and symplectic: a composition of exact flows (E. Hairer,
C. Lubich, G. Wanner, "Geometric Numerical Integration", 2nd edition, 2006, section II.5).

Stability.  Let A₁ and A₂ be the stiffness of both groups per unit mass, positive semidefinite.
Positions at times that are h/2 apart satisfy xⱼ₊₁ + xⱼ₋₁ = Cⱼ xⱼ with C = 2 − h²/2 A₁ and
2 − h²/2 A₂ in turn.  Two such equations give xⱼ₊₂ + xⱼ₋₂ = (C₁ C₂ − 2) xⱼ.  If no eigenvalue of h² A₁
and none of h² A₂ exceeds 4, both C lie between 0 and 2; the eigenvalues of their product are then
real and between 0 and 4, so that those of the right side lie between −2 and 2: no mode grows.  The
step is limited by the stiffer *group*, and not by the sum of both, and for as many evaluations of
each spring it is longer than that of Verlet: by √(3/2) for a flat sheet whose shear springs are
half as stiff as its structural ones.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import numpy as np

from ..grid import Array
from ..stability import group_bounds
from .integrator import OTHERS, STRUCTURAL, Step, SubstepBatch, dissipation_schedule

if TYPE_CHECKING:
    from ...scene import Scene

# Position error at the stability limit, as a share of the sheet's diagonal, as cloth_tradeoff
# measures it on the scenes of config/ where they are not chaotic.
_ERROR_AT_LIMIT = 2e-4


class StaggeredVerlet:
    """Verlet whose structural springs kick half a step before the others."""

    name = 'staggered_verlet'
    order = 2

    @staticmethod
    def stable_step(elastic: float, viscous: float) -> float:
        """Return the longest stable step, s, for one group with stiffness λ up to `elastic`."""
        return 2 / math.sqrt(elastic) if elastic > 0 else math.inf

    @staticmethod
    def stability_limit(scene: Scene) -> float:
        """Return the longest step, s, that is stable in every state of a scene."""
        return StaggeredVerlet.stable_step(max(group_bounds(scene)), 0.0)

    @staticmethod
    def amplification(h: float, elastic: float, viscous: float) -> Array:
        """Return the matrix of a step on ẍ = −λ x, all of λ structural, for (x, ẋ)."""
        kick = np.array([[1, 0], [-0.5 * h * elastic, 1]])
        drift = np.array([[1, h], [0, 1]])
        step: Array = kick @ drift @ kick
        return step

    @staticmethod
    def accurate_step(scene: Scene) -> float:
        """Return the step, s, whose error is about the tolerance; see `PositionVerlet`."""
        at_limit = _ERROR_AT_LIMIT * scene.sheet.diagonal
        if at_limit == 0:
            return math.inf
        limit = StaggeredVerlet.stability_limit(scene)
        return limit * math.sqrt(scene.solver.tolerance / at_limit)

    @staticmethod
    def steps(batch: SubstepBatch) -> tuple[Step, ...]:
        """Return the kicks and drifts of a batch."""
        return _steps(*batch)


@functools.lru_cache(maxsize=64)
def _steps(count: int, h: float, dissipation_interval: int) -> tuple[Step, ...]:
    # Dissipation acts in the kicks by the others, which are in the middle of the substeps.
    weights: list[int] = []
    for undamped, weight in dissipation_schedule(count, dissipation_interval):
        weights += [0] * undamped + [weight] * (weight > 0)
    steps = [Step(None, 0.0, 0, OTHERS), Step(0.5 * h, 0.5 * h, 0, STRUCTURAL)]
    for number, weight in enumerate(weights):
        last = number == count - 1
        steps.append(Step(h, 0.5 * h, weight, OTHERS))
        steps.append(
            Step(0.5 * h, 0.0, 0, STRUCTURAL) if last else Step(h, 0.5 * h, 0, STRUCTURAL)
        )
    return tuple(steps)
