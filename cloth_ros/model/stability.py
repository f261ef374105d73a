"""
Bounds of stiffness and damping that hold in every state of a cloth, for the stability limit.

An explicit integrator is stable on a mode while its stiffness λ and damping μ, both per unit
mass, are small for the step, h ω ≤ 2 without damping (see `integrators`).  The stiffness matrix
of a spring is k (d dᵀ + s (I − d dᵀ)), with s = 1 − L/r below 1 in every state, so it never
exceeds k I.  Therefore the largest eigenvalue of the *graph Laplacian* with the springs'
stiffness as weights bounds λ in every state of the cloth: flat, stretched or crumpled.  (On a
flat sheet alone the step could be about 1.2 times longer.)  That a frozen state is stable does
not keep fast motion from gaining energy: see `time_step.substep_division`.

Three bounds of that eigenvalue, each at most the one before it:

* Gershgorin: twice the largest sum of stiffness at a particle.
* The symbol: on an infinite sheet the eigenvectors are plane waves (von Neumann).  Cutting the
  sheet out of it and pinning particles can only lower the eigenvalues.
* Power iteration on the sheet itself, where it is so small or narrow that its edges matter.
"""

from __future__ import annotations

import functools

import numpy as np

from ..scene import Scene
from .forces.springs import SPRING_TYPES, STENCIL, offset_views
from .grid import Array

# Substeps stay this fraction below the limit: the bounds hold for a frozen state, and the state
# changes from substep to substep.
SAFETY = 0.9

# Sheets with more particles than this in both directions are taken as infinite: the symbol
# is within 2 % there.
_NARROW = 16
_ITERATIONS = 200
# Power iteration approaches from below; its result is raised by this factor.
_MARGIN = 1.02

# Of structural, shear and bending springs, in the order of SPRING_TYPES.
Weights = tuple[float, float, float]


def _weighted_stencil(weights: Weights) -> list[tuple[float, int, int]]:
    """Return weight, rows and columns of each spring of the stencil."""
    return [(weights[SPRING_TYPES.index(name)], rows, columns) for name, rows, columns in STENCIL]


def _symbol_bound(rows: int, columns: int, weights: Weights) -> float:
    """Return the largest eigenvalue on the infinite sheet, N/m."""
    # Plane waves with phase differences along the columns and along the rows.
    across, down = np.meshgrid(*[np.arccos(np.linspace(-1, 1, 201))] * 2)
    symbol = np.zeros_like(across)
    for weight, i, j in _weighted_stencil(weights):
        if i < rows and abs(j) < columns:
            symbol += 2 * weight * (1 - np.cos(i * down + j * across))
    return float(np.max(symbol))


def gershgorin_bound(rows: int, columns: int, weights: Weights) -> float:
    """Return twice the largest sum of stiffness at one particle, N/m."""

    def neighbours(n: int, distance: int) -> int:
        """Return the most particles of a row of n at this distance from one of them."""
        return (n > distance) + (n > 2 * distance)

    total = 0.0
    for weight, i, j in _weighted_stencil(weights):
        sides = [neighbours(n, abs(k)) for n, k in ((rows, i), (columns, j)) if k]
        # The two diagonal offsets together have the product of both numbers.
        total += weight * (sides[0] if len(sides) == 1 else 0.5 * sides[0] * sides[1])
    return 2 * total


def _laplacian(field: Array, weights: Weights) -> Array:
    out = np.zeros_like(field)
    for weight, rows, columns in _weighted_stencil(weights):
        if weight == 0 or rows >= field.shape[0] or abs(columns) >= field.shape[1]:
            continue
        first, second = offset_views(field, rows, columns)
        tension = weight * (first - second)
        first, second = offset_views(out, rows, columns)
        first += tension
        second -= tension
    return out


def _power_iteration(rows: int, columns: int, weights: Weights) -> float:
    """Return the largest eigenvalue of the sheet's graph Laplacian, N/m, from below."""
    field = np.random.default_rng(0).standard_normal((rows, columns))
    value = 0.0
    for _ in range(_ITERATIONS):
        field /= np.linalg.norm(field)
        product = _laplacian(field, weights)
        before, value = value, float(np.linalg.norm(product))
        if value == 0 or abs(value - before) < 1e-5 * value:
            break
        field = product
    return value


@functools.lru_cache(maxsize=64)
def largest_eigenvalue(rows: int, columns: int, weights: Weights) -> float:
    """
    Return an upper bound of the largest eigenvalue of the graph Laplacian, N/m.

    Parameters
    ----------
    rows, columns
        Particles of the sheet.
    weights
        Weight of the structural, shear and bending springs.

    """
    bound = min(
        gershgorin_bound(rows, columns, weights),
        _symbol_bound(rows, columns, weights),
    )
    if min(rows, columns) > _NARROW or bound == 0:
        return bound
    # Long strips are periodic: a longer piece has no noticeably larger eigenvalue.
    piece = (min(rows, 8 * _NARROW), min(columns, 8 * _NARROW))
    return min(bound, _MARGIN * _power_iteration(*piece, weights))


def rate_bounds(scene: Scene) -> tuple[float, float]:
    """Return bounds of stiffness, 1/s², and damping, 1/s, per unit mass in every state."""
    springs, sheet = scene.springs, scene.sheet
    stiffness = (springs.structural, springs.shear, springs.bending)
    present = (float(stiffness[0] > 0), float(stiffness[1] > 0), float(stiffness[2] > 0))
    size = (sheet.rows, sheet.columns)
    return (
        largest_eigenvalue(*size, stiffness) / sheet.particle_mass,
        springs.damping * largest_eigenvalue(*size, present) / sheet.particle_mass,
    )
