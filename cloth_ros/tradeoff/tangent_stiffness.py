"""
The stability limit of one state of a cloth, from its tangent stiffness.

Where the ends of a spring are displaced by u and w, its force changes by −K (u − w) with

    K = k (d dᵀ + (1 − L/r) (I − d dᵀ)),

d the direction of the spring and r its length (Choi and Ko, "Stable but responsive cloth", 2002,
equation 8), and the force of its dashpot, where the ends move at u and w, by −c d dᵀ (u − w).  The
bound of `model.stability` holds in every state; this limit is sharp in one, and the bound is
measured against it.

An integrator that kicks by −h E (K x + C v), with K and C per unit mass and of the whole sheet,
and then drifts becomes unstable in two ways.  Either a disturbance changes its sign in a step and
keeps its size, z = −1, which is where E (h² K + 2 h C) has the eigenvalue 4; or damping alone
makes it grow, which is where h times the largest eigenvalue of C exceeds the limit of the
integrator.  K and C have no modes in common, so that what is known of an integrator for single
oscillators is not enough.  E is I − h C/2 for the midpoint rule of position Verlet.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..model.forces.springs import spring_ends, spring_families
from ..model.grid import Array
from ..model.time_step import integrator_for
from ..scene import Scene
from .eigenvalues import has_eigenvalue_above, largest_eigenvalue

# Residuals of eigenvalues that are small enough, as a share of the eigenvalue: symmetric matrices
# have theirs at least as exact, and with them the limit to half of that.
_TOLERANCE = 1e-4
_HALVINGS = 10  # of an interval of 1 to 1.5: the limit is then right to 0.1 %
# Springs shorter than this share of their rest length count as that long: they have no stiffness
# that limits the step, and one without a length would have none that is finite.
_SHORTEST = 1e-6


class TangentStiffness:
    """
    Stiffness and damping, per unit mass, of a sheet about one state.

    Parameters
    ----------
    scene
        Its springs, masses and pins.
    grid
        Positions, m, shape (3, rows, columns).

    """

    def __init__(self, scene: Scene, grid: Array) -> None:
        self._free = ~scene.pinned()
        self._mass = scene.sheet.particle_mass
        self._damping = scene.springs.damping
        self._springs = []
        for family in spring_families(scene):
            p, q = spring_ends(family, grid)
            length = np.linalg.norm(p - q, axis=0)
            length = np.maximum(length, _SHORTEST * family.rest_length)
            across = family.stiffness * (1 - family.rest_length / length)
            self._springs.append((family, (p - q) / length, across))

    def stiffness(self, field: Array) -> Array:
        """Return K times a field, shape (3, rows, columns); zero for pinned particles."""
        return self._apply(field, damping=False)

    def damping(self, field: Array) -> Array:
        """Return C times a field, shape (3, rows, columns); zero for pinned particles."""
        return self._apply(field, damping=True)

    def _apply(self, field: Array, *, damping: bool) -> Array:
        field = field * self._free  # columns as well as rows, so that K and C are symmetric
        out = np.zeros_like(field)
        for family, direction, across in self._springs:
            u, w = spring_ends(family, field)
            along = direction * np.sum(direction * (u - w), axis=0)
            if damping:
                force = self._damping * along
            else:
                force = family.stiffness * along + across * (u - w - along)
            first, second = spring_ends(family, out)
            first += force
            second -= force
        product: Array = out * self._free / self._mass
        return product

    def kick(self, h: float, plain: float, damped: float) -> Callable[[Array], Array]:
        """Return E (h² K + 2 h C)/4 with E = `plain` I + `damped` C, for a step of h s."""

        def apply(field: Array) -> Array:
            out = 0.25 * h * (h * self.stiffness(field) + 2 * self.damping(field))
            kick: Array = plain * out + damped * self.damping(out)
            return kick

        return apply


def stability_limit(scene: Scene, positions: Array) -> float:
    """
    Return the longest step at which small disturbances of a state do not grow, s.

    For explicit integrators; inf without springs, or with all particles pinned.  Air and drag are
    left out: they only add to stability.  So is growth that is not of the integrator: compressed
    springs buckle at any step.

    Parameters
    ----------
    scene
        Its springs, masses, pins and integrator.
    positions
        m, shape (rows, columns, 3).

    Raises
    ------
    NotConvergedError
        The largest eigenvalue of K or C was not found.

    """
    free = ~scene.pinned()
    if not free.any() or not any(True for _ in spring_families(scene)):
        return math.inf
    integrator = integrator_for(scene)
    tangent = TangentStiffness(scene, np.moveaxis(np.asarray(positions, float), -1, 0))
    start = np.random.default_rng(0).standard_normal((3, *free.shape)) * free

    def largest(operator: Callable[[Array], Array]) -> float:
        return max(largest_eigenvalue(operator, start, _TOLERANCE, symmetric=True).real, 0.0)

    elastic = largest(tangent.stiffness)
    viscous = largest(tangent.damping) if scene.springs.damping > 0 else 0.0
    stable = integrator.stable_step(elastic, viscous)
    end = integrator.stable_step(0.0, viscous)
    if viscous == 0 or not math.isfinite(stable):
        return stable

    def unstable(h: float) -> bool:
        # How a kick by elastic forces depends on damping, read off the integrator.
        plain, damped = (-integrator.amplification(h, 1.0, rate)[1, 0] / h for rate in (0.0, 1.0))
        kick = tangent.kick(h, plain, damped - plain)
        return has_eigenvalue_above(kick, start, 1.0, _TOLERANCE)

    low, high = stable, min(1.5 * stable, end)
    while not unstable(high):
        if high == end:
            return end
        low, high = high, min(1.5 * high, end)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if unstable(middle):
            high = middle
        else:
            low = middle
    return low
