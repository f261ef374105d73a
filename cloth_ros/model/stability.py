"""
The longest stable substep of explicit integration, whatever the state of the cloth.

An explicit method is stable on a mode while its stiffness λ and damping μ, both per unit mass,
are small for the step, h ω ≤ 2 without damping (see `methods`).  The stiffness matrix of a
spring is k (d dᵀ + s (I − d dᵀ)), with s = 1 − L/r below 1 in every state, so it never exceeds
k I.  Therefore the largest eigenvalue of the *graph Laplacian* with the springs' stiffness as
weights bounds λ for every state of the cloth, flat, stretched or crumpled; `tangent` has that of
one state.  (On a flat sheet alone the step could be about 1.2 times longer.)  That a frozen state
is stable does not keep violent motion from gaining energy: see `substeps.refinement`.

Three bounds of that eigenvalue, each at most the one before it:

* Gershgorin: twice the largest sum of stiffness at a particle.
* The symbol: on an infinite sheet the eigenvectors are plane waves (von Neumann).  Cutting the
  sheet out of it and pinning particles can only lower the eigenvalues.
* Power iteration on the sheet itself, where it is so small or narrow that its edges matter.
"""

from __future__ import annotations

import functools

import numpy as np

from .grid import Array

# Substeps stay this fraction below the limit: the bounds hold for a frozen state, and the state
# changes from substep to substep.
SAFETY = 0.9

# Sheets with more particles than this in both directions are as good as infinite: the symbol
# is within 2 % there.
_NARROW = 16
_ITERATIONS = 200
# Power iteration approaches from below; this much is added to what it found.
_MARGIN = 1.02

Weights = tuple[float, float, float]


def _symbol_bound(rows: int, columns: int, weights: Weights) -> float:
    """Return the largest eigenvalue on the infinite sheet, N/m."""
    structural, shear, bending = weights
    # Plane wave with phases a along the rows and b along the columns; x = cos a, y = cos b.
    # The sums over a family's springs at one particle, k Σ (1 − cos phase), doubled:
    x, y = np.meshgrid(np.linspace(-1, 1, 201), np.linspace(-1, 1, 201))
    along = (1 - x) * (columns > 1) + (1 - y) * (rows > 1)
    diagonal = 2 * (1 - x * y) * (rows > 1 and columns > 1)
    second = 2 * (1 - x * x) * (columns > 2) + 2 * (1 - y * y) * (rows > 2)
    return float(np.max(2 * structural * along + 2 * shear * diagonal + 2 * bending * second))


def gershgorin_bound(rows: int, columns: int, weights: Weights) -> float:
    """Return twice the largest sum of stiffness at one particle, N/m."""
    structural, shear, bending = weights
    total = structural * (min(columns - 1, 2) + min(rows - 1, 2))
    total += shear * min(columns - 1, 2) * min(rows - 1, 2)
    total += bending * sum(2 if n > 4 else (n > 2) for n in (rows, columns))
    return 2 * total


def _laplacian(field: Array, weights: Weights) -> Array:
    structural, shear, bending = weights
    out = np.zeros_like(field)
    for weight, rows, columns in (
        (structural, 0, 1),
        (structural, 1, 0),
        (shear, 1, 1),
        (shear, 1, -1),
        (bending, 0, 2),
        (bending, 2, 0),
    ):
        height, width = field.shape[0] - rows, field.shape[1] - abs(columns)
        if weight == 0 or height < 1 or width < 1:
            continue
        left, right = max(-columns, 0), max(columns, 0)
        first = (slice(0, height), slice(left, left + width))
        second = (slice(rows, None), slice(right, right + width))
        tension = weight * (field[first] - field[second])
        out[first] += tension
        out[second] -= tension
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
    # Long strips repeat themselves: a longer piece has no larger eigenvalue to speak of.
    piece = (min(rows, 8 * _NARROW), min(columns, 8 * _NARROW))
    return min(bound, _MARGIN * _power_iteration(*piece, weights))


def bounds(
    *, rows: int, columns: int, particle_mass: float, stiffness: Weights, damping: float
) -> tuple[float, float]:
    """
    Return bounds of stiffness and damping per unit mass, 1/s² and 1/s, in every state.

    Parameters
    ----------
    rows, columns
        Particles of the sheet.
    particle_mass
        kg.
    stiffness
        Of the structural, shear and bending springs, N/m; 0: absent.
    damping
        Of the dashpot along each present spring, N·s/m.

    """
    present = (float(stiffness[0] > 0), float(stiffness[1] > 0), float(stiffness[2] > 0))
    return (
        largest_eigenvalue(rows, columns, stiffness) / particle_mass,
        damping * largest_eigenvalue(rows, columns, present) / particle_mass,
    )
