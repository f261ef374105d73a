"""
Bounds of stiffness and damping that hold in every state of a cloth, for the stability limit.

An explicit integrator is stable on a mode while its stiffness λ and damping μ, both per unit
mass, are small for the step, h ω ≤ 2 without damping (see `integrators`).  The stiffness matrix
of a spring is k (d dᵀ + s (I − d dᵀ)), with s = 1 − L/r below 1 in every state, so it never
exceeds k I.  Therefore the largest eigenvalue of the *graph Laplacian* with the springs'
stiffness as weights bounds λ in every state of the cloth: flat, stretched or crumpled.  (On a
flat sheet alone the step could be about 1.2 times longer.)  That a frozen state is stable does
not keep fast motion from gaining energy: see `time_step.substep_division`.

The eigenvalue is known exactly.  With half the stiffness and mass at the edges (see
`forces.springs`) the sheet moves as a part of an unbounded one that is symmetric about its edges.
There, the eigenvectors are plane waves (von Neumann); those that are symmetric about the edges of
n particles are the cosines with the phases π k/(n − 1), k = 0, …, n − 1, and their eigenvalue is
the symbol of the springs at these phases.  Pinning particles can only lower the largest.
"""

from __future__ import annotations

import functools

import numpy as np

from ..scene import Scene
from .forces.springs import SPRING_TYPES, STENCIL
from .grid import Array

# Substeps stay this fraction below the limit: the bounds hold for a frozen state, and the state
# changes from substep to substep.
SAFETY = 0.9
# The same for the limit of the present state, which is bounded again after each tick.
PRESENT_SAFETY = 0.96

# Phases of a side of more particles than this are sampled, evenly in their cosine.
_SAMPLES = 201

# Of structural, shear and bending springs, in the order of SPRING_TYPES.
Weights = tuple[float, float, float]


def _weighted_stencil(weights: Weights) -> list[tuple[float, int, int]]:
    """Return weight, rows and columns of each spring of the stencil."""
    return [(weights[SPRING_TYPES.index(name)], rows, columns) for name, rows, columns in STENCIL]


def _phases(count: int) -> Array:
    """Return the phase differences of the eigenvectors along a side of `count` particles."""
    if count > _SAMPLES:
        sampled: Array = np.arccos(np.linspace(-1, 1, _SAMPLES))
        return sampled
    return np.pi * np.arange(count) / max(count - 1, 1)


@functools.lru_cache(maxsize=64)
def largest_eigenvalue(rows: int, columns: int, weights: Weights) -> float:
    """
    Return the largest eigenvalue of the graph Laplacian per mass of a cell, N/m.

    Parameters
    ----------
    rows, columns
        Particles of the sheet.
    weights
        Weight of the structural, shear and bending springs.

    """
    across, down = np.meshgrid(_phases(columns), _phases(rows))
    symbol = np.zeros_like(across)
    for weight, i, j in _weighted_stencil(weights):
        if i < rows and abs(j) < columns:
            symbol += 2 * weight * (1 - np.cos(i * down + j * across))
    return float(np.max(symbol))


def rate_bounds(scene: Scene) -> tuple[float, float]:
    """Return bounds of stiffness, 1/s², and damping, 1/s, per unit mass in every state."""
    springs, sheet = scene.springs, scene.sheet
    stiffness = (springs.structural, springs.shear, springs.bending)
    present = (float(stiffness[0] > 0), float(stiffness[1] > 0), float(stiffness[2] > 0))
    size = (sheet.rows, sheet.columns)
    return (
        largest_eigenvalue(*size, stiffness) / sheet.cell_mass,
        springs.damping * largest_eigenvalue(*size, present) / sheet.cell_mass,
    )
