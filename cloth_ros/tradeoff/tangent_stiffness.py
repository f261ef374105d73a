"""
The stability limit of one state of a cloth, from its tangent stiffness.

Where the ends of a spring are displaced by u and w, its force changes by −K (u − w) with

    K = k (d dᵀ + (1 − L/r) (I − d dᵀ)),

d the direction of the spring and r its length (Choi and Ko, "Stable but responsive cloth", 2002,
equation 8), and the force of its dashpot, where the ends move at u and w, by −c d dᵀ (u − w).  The
bound of `model.stability` holds in every state; this limit is sharp in one, and the bound is
measured against it.

An integrator becomes unstable in two ways.  Either a disturbance changes its sign in a step and
keeps its size, z = −1, which for position Verlet is where h² K has the eigenvalue 4, whatever the
dashpots do; or damping alone makes it grow, which is where h times the largest eigenvalue of C
exceeds what the stages of the dashpots reach.  K and C have no modes in common; but each limit is
that of one of them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..model.forces.springs import spring_ends, spring_families
from ..model.grid import Array, Grid
from ..model.time_step import integrator_for
from ..scene import Scene
from .eigenvalues import largest_eigenvalue

# Residuals of eigenvalues that are small enough, as a share of the eigenvalue: symmetric matrices
# have theirs at least as exact, and with them the limit to half of that.
_TOLERANCE = 1e-4
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

    Attributes
    ----------
    stiffness, damping
        K, 1/s², and C, 1/s: sparse matrices of x, y and z of all free particles, in this order.
        Of displacements times the root of the mass, so that they are symmetric.

    """

    def __init__(self, scene: Scene, grid: Array) -> None:
        rows, columns = grid.shape[1:]
        number = np.arange(rows * columns).reshape(rows, columns)
        ends, directions, along, across, dashpots = [], [], [], [], []
        for family in spring_families(scene):
            p, q = (end.reshape(3, -1) for end in spring_ends(family, grid))
            length = np.linalg.norm(p - q, axis=0)
            length = np.maximum(length, _SHORTEST * family.rest_length)
            ends.append(np.stack([end.ravel() for end in spring_ends(family, number)]))
            directions.append((p - q) / length)
            shape = spring_ends(family, number)[0].shape
            weights = np.broadcast_to(family.weights(rows, columns), shape).ravel()
            along.append(family.stiffness * weights)
            across.append(along[-1] * (1 - family.rest_length / length))
            dashpots.append(scene.springs.damping * weights)
        free = ~scene.pinned().ravel()
        masses = scene.sheet.cell_mass * Grid(rows, columns).tributary_areas.ravel()
        incidence = _incidence(np.concatenate(ends, axis=1), 1 / np.sqrt(masses))[:, free]
        direction = np.concatenate(directions, axis=1)
        k, c = np.concatenate(along), np.concatenate(dashpots)
        self.stiffness = _assemble(incidence, direction, k, np.concatenate(across))
        self.damping = _assemble(incidence, direction, c, 0 * c)


def _incidence(ends: Array, scale: Array) -> Any:
    """
    Return the matrix of differences between the ends of springs.

    Parameters
    ----------
    ends
        Indices of particles, shape (2, springs).
    scale
        Factor of each particle's column, shape (particles,).

    """
    from scipy.sparse import csr_array

    springs = ends.shape[1]
    values = np.repeat([1.0, -1.0], springs) * scale[ends.ravel()]
    rows = np.tile(np.arange(springs), 2)
    return csr_array((values, (rows, ends.ravel())), shape=(springs, len(scale)))


def _assemble(incidence: Any, direction: Array, along: Array, across: Array) -> Any:
    """
    Return the matrix of springs.

    Parameters
    ----------
    incidence
        Differences between their ends.
    direction
        Unit vectors, shape (3, springs).
    along, across
        Stiffness, N/m, in their direction and across it, shape (springs,).

    """
    from scipy.sparse import block_array, dia_array

    def block(i: int, j: int) -> Any:
        k = (along - across) * direction[i] * direction[j] + (i == j) * across
        return incidence.T @ dia_array((k[None], [0]), shape=(len(k), len(k))) @ incidence

    return block_array([[block(i, j) for j in range(3)] for i in range(3)], format='csr')


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
    tangent = TangentStiffness(scene, np.moveaxis(np.asarray(positions, float), -1, 0))
    start = np.random.default_rng(0).standard_normal(3 * free.sum())
    elastic, viscous = (
        max(largest_eigenvalue(matrix.dot, start, _TOLERANCE, symmetric=True).real, 0.0)
        for matrix in (tangent.stiffness, tangent.damping)
    )
    return integrator_for(scene).stable_step(elastic, viscous)
