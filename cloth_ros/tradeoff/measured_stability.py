"""
Measured stability limits: the substep from which on a disturbance of a state grows.

The substeps are real ones, of the integrator and the compiled kernels in double precision.  The
acceleration of the undisturbed state is subtracted, which makes it an equilibrium; a substep is
then a map of disturbances of positions and velocities, linear for small ones.  A disturbance grows
over many substeps where this map has an eigenvalue |z| > 1.

Growth alone does not mean that the integration is unstable.  Compressed springs buckle, so that
disturbances of the real cloth grow at any substep, in a crumpled sheet faster than an unstable
integration does.  Buckling keeps its direction, z > 1.  What the cloth cannot do is to change the
sign of a disturbance in every substep and grow, z < −1; therefore the smallest real part of all z
is the one that counts.

Damping that is integrated unstably may also keep its direction.  It is measured separately, with
positions held fixed, where springs cannot buckle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..model.forces.springs import spring_families
from ..model.grid import Array, Grid, flat_sheet
from ..model.integrators import kick_drift_kernel as kernel
from ..model.integrators.integrator import SubstepBatch
from ..model.integrators.kick_drift import KickDrift
from ..model.state import State
from ..model.time_step import integrator_for
from ..model.time_step import stability_limit as bound_of_all_states
from ..scene import Scene
from .eigenvalues import has_eigenvalue_above
from .tangent_stiffness import stability_limit

# Largest number of rows and columns that is measured: the edges of a larger sheet have no
# influence on its limit.
_LARGEST = 24
# Norm of a disturbance as a share of the shortest spacing: forces are linear, and rounding is
# small, both to about 1e-7.
_SMALL = 1e-5
# Residual of an eigenvalue z of the map, as a share of it.
_TOLERANCE = 1e-4
# Excess of |z| over 1 that counts as growth.  At the limit two z coincide in −1, where the error
# of an eigenvalue is the root of the residual, 0.01.  A substep too long by the share δ has
# |z| = 1 + √(8 δ) there, so that this is a δ of 5e-5; where damping alone is unstable, it is one
# of a percent.
_GROWTH = 0.02
_PRECISION = 0.005  # of the limit
_WIDEST = 1e6  # multiple of the bound at which the search for a limit ends

_STRETCHED, _STRONGLY = 1.5, 10.0
_CRUMPLED = 0.5


@dataclass(frozen=True)
class StabilityComparison:
    """
    Stability limits of one state.

    Attributes
    ----------
    state
        Its name.
    rows, columns
        Of the sheet, or of the part of it that was measured.
    predicted, bound, measured
        Longest stable substep, s: by the tangent stiffness, in every state, and as measured.

    """

    state: str
    rows: int
    columns: int
    predicted: float
    bound: float
    measured: float


class _BalancedStep:
    """
    Substeps of a sheet with the forces of one state subtracted, which makes it an equilibrium.

    Parameters
    ----------
    scene
        Its springs, pins and integrator.
    state
        The equilibrium; substeps change it in place.

    Attributes
    ----------
    damped
        True if forces depend on velocities.

    """

    def __init__(self, scene: Scene, state: State) -> None:
        self._state = state
        self._kick_drift = KickDrift(scene, state.grid, state.dtype, separate=True)
        self._integrator = integrator_for(scene)
        self.damped = self._kick_drift.damped
        self._kick_drift.accelerate(state)
        self._undisturbed = state.acceleration.copy()

    def apply(self, h: float, *, held: bool) -> None:
        """Take a substep of `h` s; with `held`, positions stay as they are."""
        state, kick_drift = self._state, self._kick_drift
        before = state.position.copy()
        for step in self._integrator.steps(SubstepBatch(1, h)):
            for row in kick_drift.operations(step):
                kick_drift.run(state, np.array([row]), (0.0, 0.0, 0.0))
                if row[0] == kernel.ACCELERATE:
                    state.acceleration -= self._undisturbed
                if held:
                    state.position[...] = before


class _Disturbances:
    """Map of disturbances of a state by substeps."""

    def __init__(self, scene: Scene, positions: Array) -> None:
        grid = np.moveaxis(np.asarray(positions, float), -1, 0)
        self._undisturbed = grid - grid.mean(axis=(1, 2), keepdims=True)
        self._state = State(Grid(scene.sheet.rows, scene.sheet.columns), np.float64)
        self._state.pin(scene.pinned())
        self._position[...] = self._undisturbed
        self._step = _BalancedStep(scene, self._state)
        self._small = _SMALL * scene.sheet.shortest_spacing
        self._free = ~scene.pinned()
        self._start = np.random.default_rng(0).standard_normal((2, *grid.shape)) * self._free

    @property
    def _position(self) -> Array:  # kernels exchange the arrays of the state
        return self._state.grid.interior(self._state.position)

    @property
    def _velocity(self) -> Array:
        return self._state.grid.interior(self._state.velocity)

    def grow(self, h: float) -> bool:
        """Return whether substeps of `h` s make disturbances grow that the cloth does not."""
        if has_eigenvalue_above(
            lambda field: -self._map(field, h), self._start, 1 + _GROWTH, _TOLERANCE
        ):
            return True
        if not self._step.damped:
            return False

        def damp(velocities: Array) -> Array:
            # Two substeps, so that z of either sign is found.
            field = np.stack([np.zeros_like(velocities), velocities])
            damped: Array = self._map(field, h, substeps=2, held=True)[1]
            return damped

        return has_eigenvalue_above(damp, self._start[1], 1 + _GROWTH, _TOLERANCE)

    def _map(self, field: Array, h: float, *, substeps: int = 1, held: bool = False) -> Array:
        """
        Return what substeps of `h` s make of a disturbance.

        Parameters
        ----------
        field
            Displacements, and velocities times `h`, relative to `_small`, shape
            (2, 3, rows, columns).
        h
            s.
        substeps
            Their number.
        held
            True to hold positions fixed.

        """
        results = []
        for sign in (1, -1):
            disturbance = sign * self._small * self._free * field
            self._position[...] = self._undisturbed + disturbance[0]
            self._velocity[...] = disturbance[1] / h
            for _ in range(substeps):
                self._step.apply(h, held=held)
            displacement = self._position - self._undisturbed
            results.append(np.stack([displacement, h * self._velocity]))
        difference: Array = (results[0] - results[1]) / (2 * self._small)
        return difference


def measured_limit(scene: Scene, positions: Array) -> float:
    """
    Return the longest stable substep about a state, s, to one percent.

    Contact, air, drag and gravity are left out; inf if nothing grows at any substep.

    Parameters
    ----------
    scene
        Its springs, masses, pins and integrator.
    positions
        m, shape (rows, columns, 3).

    """
    scene = _springs_alone(scene)
    bound = bound_of_all_states(scene)
    if scene.pinned().all() or not any(True for _ in spring_families(scene)):
        return math.inf
    disturbances = _Disturbances(scene, positions)
    low = high = bound
    while disturbances.grow(low):
        low, high = 0.5 * low, low
    while low == high or not disturbances.grow(high):
        low, high = high, 1.5 * high
        if high > _WIDEST * bound:
            return math.inf
    while high > (1 + _PRECISION) * low:
        middle = math.sqrt(low * high)
        if disturbances.grow(middle):
            high = middle
        else:
            low = middle
    return math.sqrt(low * high)


def states(scene: Scene) -> dict[str, Array]:
    """Return states of a sheet by name: positions about its centre, m, (rows, columns, 3)."""
    sheet = scene.sheet
    flat = flat_sheet(sheet.rows, sheet.columns, sheet.spacing, sheet.orientation)
    undeformed = np.moveaxis(flat, 0, -1)
    direction = np.random.default_rng(1).standard_normal(undeformed.shape)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    spacing = min(sheet.shortest_spacing, 1.0)  # inf for a single particle
    return {
        'undeformed': undeformed,
        'stretched': _STRETCHED * undeformed,
        'strongly stretched': _STRONGLY * undeformed,
        'crumpled': undeformed + _CRUMPLED * spacing * direction,
    }


def compare(scene: Scene, method: str, state: str) -> StabilityComparison:
    """
    Return predicted and measured stability limits of an integrator in one of the `states`.

    Of a sheet with more than 24 rows or columns, the first 24 are measured, with their particles,
    springs and pins.
    """
    scene = scene.with_parameters({'solver.method': method, 'solver.substeps': 0})
    piece = _piece(scene)
    positions = states(piece)[state]
    return StabilityComparison(
        state,
        piece.sheet.rows,
        piece.sheet.columns,
        stability_limit(piece, positions),
        bound_of_all_states(scene),
        measured_limit(piece, positions),
    )


def _springs_alone(scene: Scene) -> Scene:
    return scene.with_parameters(
        {
            'drag': 0.0,
            'gravity': [0.0, 0.0, 0.0],
            'wind.air_density': 0.0,
            'sphere.radius': 0.0,
            'solver.substeps': 0,
        }
    )


def _piece(scene: Scene) -> Scene:
    """Return a scene with those rows and columns of a sheet that are measured."""
    sheet = scene.sheet
    rows, columns = min(sheet.rows, _LARGEST), min(sheet.columns, _LARGEST)
    if (rows, columns) == (sheet.rows, sheet.columns):
        return scene
    pins = [f'{row},{column}' for row, column in np.argwhere(scene.pinned()[:rows, :columns])]
    dx, dy = sheet.spacing
    return scene.with_parameters(
        {
            'pins': pins or [''],
            'sheet.rows': rows,
            'sheet.columns': columns,
            'sheet.size': [dx * max(columns - 1, 1), dy * max(rows - 1, 1)],
            'sheet.mass': sheet.cell_mass * max(rows - 1, 1) * max(columns - 1, 1),
        }
    )
