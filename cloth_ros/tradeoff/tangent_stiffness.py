"""
The stability limit of one state of a cloth, from its tangent stiffness.

The force of a spring changes, when its ends are moved by u and w, by −K (u − w) with

    K = k (d dᵀ + (1 − L/r) (I − d dᵀ)),

d the direction of the spring and r its length (Choi and Ko, "Stable but responsive cloth", 2002,
equation 8), and that of its dashpot, when they are moved at u and w, by −c d dᵀ (u − w).  The
bound of `stability` holds for every state; this is sharp for one, and what the bound is measured
against.

A method that kicks by −h E (K x + C v), K and C per unit mass and of the whole sheet, and then
drifts, breaks in two ways.  Either a disturbance turns over in a step and returns as large as it
was, z = −1, which is where E (h² K + 2 h C) has the eigenvalue 4; or damping alone makes it grow,
which is where h times the largest eigenvalue of C exceeds what the method bears.  K and C have no
modes in common, so that what a method says of oscillators is not enough.  E is I − h C/2 for the
midpoint rule of position Verlet.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..model.forces.springs import spring_ends, spring_families
from ..model.grid import Array
from ..model.time_step import integrator_for
from ..scene import Scene

_STEPS = 200  # of the Arnoldi iteration at most
# Residual at which it ends, as a share of the eigenvalue: no less than the error of that of a
# symmetric matrix, and so of K and C.
_RESIDUAL = 1e-3
_LOOK_EVERY = 20
_EXHAUSTED = 1e-10
_HALVINGS = 10  # of an interval of 1 to 1.5: the limit is then right to 0.1 %
# Springs shorter than this share of their rest length count as no shorter: they are soft anyway,
# and one without a length would have no stiffness that is finite.
_SHORTEST = 1e-6


def eigenvalue_with_largest_real_part(
    operator: Callable[[Array], Array], start: Array, residual: float = _RESIDUAL
) -> tuple[complex, Array, float]:
    """
    Return the eigenvalue of a real operator with the largest real part, after Arnoldi (1951).

    Parameters
    ----------
    operator
        Takes and returns an array of the shape of `start`.
    start
        A first guess of the eigenvector; what it has no share in is not found.
    residual
        Share of the eigenvalue at which the residual is small enough.

    Returns
    -------
    (complex, array, float)
        The eigenvalue, the real part of its eigenvector, and the share that the residual is.

    """
    steps = min(_STEPS, start.size)
    basis = np.zeros((steps, start.size))
    matrix = np.zeros((steps, steps))
    product, length = start.ravel(), float(np.linalg.norm(start))
    for n in range(steps):
        basis[n] = product / length
        product = operator(basis[n].reshape(start.shape)).ravel()
        for _ in range(2):  # once more, for what rounding has left
            shares = basis[: n + 1] @ product
            matrix[: n + 1, n] += shares
            product = product - shares @ basis[: n + 1]
        length = float(np.linalg.norm(product))
        last = n + 1 == steps or length <= _EXHAUSTED * np.abs(matrix).max()
        if last or (n + 1) % _LOOK_EVERY == 0:
            values, vectors = np.linalg.eig(matrix[: n + 1, : n + 1])
            best = int(np.argmax(values.real))
            left = length * abs(vectors[-1, best])
            if last or left <= residual * abs(values[best]):
                break
        matrix[n + 1, n] = length
    mode: Array = (vectors[:, best] @ basis[: n + 1]).real.reshape(start.shape)
    return complex(values[best]), mode, float(left / max(abs(values[best]), 1e-300))


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
        self._mobility = ~scene.pinned() / scene.sheet.particle_mass
        self._damping = scene.springs.damping
        self._springs = []
        for family in spring_families(scene):
            p, q = spring_ends(family, grid)
            length = np.linalg.norm(p - q, axis=0)
            length = np.maximum(length, _SHORTEST * family.rest_length)
            across = family.stiffness * (1 - family.rest_length / length)
            self._springs.append((family, (p - q) / length, across))

    def stiffness(self, field: Array) -> Array:
        """Return K times a field of shape (3, rows, columns)."""
        return self._apply(field, damping=False)

    def damping(self, field: Array) -> Array:
        """Return C times a field of shape (3, rows, columns)."""
        return self._apply(field, damping=True)

    def _apply(self, field: Array, *, damping: bool) -> Array:
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
        product: Array = out * self._mobility
        return product

    def turning(self, plain: float, damped: float, h: float) -> Callable[[Array], Array]:
        """Return E (h² K + 2 h C)/4 with E = `plain` I + `damped` C."""

        def apply(field: Array) -> Array:
            out = 0.25 * h * (h * self.stiffness(field) + 2 * self.damping(field))
            turned: Array = plain * out + damped * self.damping(out) if damped else plain * out
            return turned

        return apply


def stability_limit(scene: Scene, positions: Array) -> float:
    """
    Return the longest step at which small disturbances of a state do not grow, s.

    For explicit methods; inf without springs, or with all particles pinned.  Air and drag, which
    only add to stability, are left out.  So is growth that is the cloth's own: compressed
    springs buckle, at any step.

    Parameters
    ----------
    scene
        Its springs, masses, pins and method.
    positions
        m, shape (rows, columns, 3).

    """
    free = ~scene.pinned()
    if not free.any() or not any(True for _ in spring_families(scene)):
        return math.inf
    method = integrator_for(scene)
    tangent = TangentStiffness(scene, np.moveaxis(np.asarray(positions, float), -1, 0))
    start = np.random.default_rng(0).standard_normal((3, *free.shape)) * free
    value, mode, _ = eigenvalue_with_largest_real_part(tangent.stiffness, start)
    elastic, viscous = max(value.real, 0.0), 0.0
    if scene.springs.damping > 0:
        viscous = max(eigenvalue_with_largest_real_part(tangent.damping, start)[0].real, 0.0)
    stable = method.stable_step(elastic, viscous)
    end = method.stable_step(0.0, viscous)
    if viscous == 0 or not math.isfinite(stable):
        return stable

    def turns(h: float) -> bool:
        nonlocal mode
        # How a kick by elastic forces depends on damping, read off the method.
        plain, damped = (-method.amplification(h, 1.0, rate)[1, 0] / h for rate in (0.0, 1.0))
        # From the last mode and all others: alone it would hide one that has overtaken it.
        guess = mode / np.linalg.norm(mode) + start / np.linalg.norm(start)
        value, mode, _ = eigenvalue_with_largest_real_part(
            tangent.turning(plain, damped - plain, h), guess
        )
        return value.real > 1

    low, high = stable, min(1.5 * stable, end)
    while not turns(high):
        if high == end:
            return end
        low, high = high, min(1.5 * high, end)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if turns(middle):
            high = middle
        else:
            low = middle
    return low
