"""
Where the methods break, measured: the step from which on a disturbance of a state grows.

The steps are real ones, made by the method and the compiled kernels in double precision.  The
acceleration of the undisturbed state is subtracted, so that it stays where it is, and a step
turns a disturbance of positions and velocities into another one.  What a disturbance becomes in
many steps is told by the eigenvalues z of this map: it grows where |z| > 1.

Growth alone does not say that a method breaks.  Compressed springs buckle, and disturbances of
the real cloth grow as well, at any step; in a crumpled sheet that is faster than a method blows
up, and whoever waits for a disturbance to become large sees nothing else.  Such growth goes on in
one direction, z > 1.  What the cloth cannot do is to turn over in every step and grow, z < −1,
and so it is the least real part of all z that is watched.  Arnoldi's iteration finds it from a
random disturbance: it makes each step from what the step before has added to all earlier ones, in
which buckling is no louder than anything else.

That a method makes damping itself grow may also be in one direction.  It is measured apart, with
positions that are held, where springs cannot buckle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..model.forces.springs import spring_families
from ..model.grid import Array, Grid, flat_sheet
from ..model.integrators import kick_drift_kernel
from ..model.integrators.integrator import SubstepBatch
from ..model.integrators.kick_drift import KickDrift
from ..model.state import State
from ..model.time_step import integrator_for
from ..scene import Scene
from .eigenvalues import has_eigenvalue_above
from .tangent_stiffness import stability_limit

# Pieces of larger sheets are as large as this in each direction: there are no edges to speak of.
_LARGEST = 24
# Length of all disturbances together, as a share of the shortest spacing: the forces are then
# linear, and rounding still small, to about 1e-7.
_SMALL = 1e-5
# Share of an eigenvalue z of the map that its residual may be.
_TOLERANCE = 1e-4
# What |z| must exceed 1 by.  At the limit two z meet in −1, where the error is the root of the
# residual; a step that is too long by the share δ has |z| = 1 + √(8 δ) there, so that this is a δ
# of 5e-5.  Where damping alone breaks a method, it is one of a percent.
_GROWTH = 0.02
_PRECISION = 0.005  # of the limit
_WIDEST = 1e6  # multiple of the bound at which the search for a limit ends

_STRETCHED, _STRONGLY = 1.5, 10.0
_CRUMPLED = 0.5


@dataclass(frozen=True)
class StabilityComparison:
    """
    The stability limits of one state.

    Attributes
    ----------
    state
        Its name.
    rows, columns
        Of the sheet, or of the piece of it, that was measured.
    predicted, bound, measured
        Longest stable step by the tangent stiffness, for every state, and as measured, s.

    """

    state: str
    rows: int
    columns: int
    predicted: float
    bound: float
    measured: float


class _Balanced(KickDrift):
    """
    Forces less those of one state, which is an equilibrium so.

    Attributes
    ----------
    held
        True if positions stay as they are.

    """

    def __init__(self, scene: Scene, state: State) -> None:
        super().__init__(scene, state.lattice, np.zeros(3), state.dtype, apart=True)
        self.held = False
        self._undisturbed = np.zeros_like(state.acceleration)
        self.accelerate(state)
        self._undisturbed = state.acceleration.copy()

    def _make(self, state: State, table: Array) -> None:
        for row in table:
            position = state.position
            super()._make(state, row[None])
            if row[0] in (kick_drift_kernel.ACCELERATE, kick_drift_kernel.ACCELERATE_MIDDLE):
                state.acceleration -= self._undisturbed
            if self.held:
                state.position[...] = position


class _Disturbances:
    """What steps make of disturbances of a state."""

    def __init__(self, scene: Scene, positions: Array) -> None:
        grid = np.moveaxis(np.asarray(positions, float), -1, 0)
        self._undisturbed = grid - grid.mean(axis=(1, 2), keepdims=True)
        self._grid_layout = Grid(scene.sheet.rows, scene.sheet.columns)
        self._state = State(self._grid_layout, np.float64)
        self._state.pin(scene.pinned())
        self._grid_layout.grid(self._state.position)[...] = self._undisturbed
        self._kick_drift = _Balanced(scene, self._state)
        self._method = integrator_for(scene)(self._kick_drift)
        self._small = _SMALL * scene.sheet.shortest_spacing
        self._free = ~scene.pinned()
        self._start = np.random.default_rng(0).standard_normal((2, *grid.shape)) * self._free

    def grow(self, h: float) -> bool:
        """Return whether steps of `h` s make disturbances grow that the cloth itself does not."""
        if has_eigenvalue_above(
            lambda field: -self._step(field, [h]), self._start, 1 + _GROWTH, _TOLERANCE
        ):
            return True
        if not self._kick_drift.damped:
            return False
        start = self._start * np.array([0.0, 1.0])[:, None, None, None]
        # Two steps, so that either sign of z is found.
        return has_eigenvalue_above(
            lambda field: self._step(field, [h, h], held=True), start, 1 + _GROWTH, _TOLERANCE
        )

    def _step(self, field: Array, steps: list[float], *, held: bool = False) -> Array:
        """Return what becomes of displacements, m, and velocities times the step, in one array."""
        self._kick_drift.held = held
        field = field * self._free
        ahead, behind = (self._run(side * field, steps) for side in (1, -1))
        return (ahead - behind) / (2 * self._small)

    def _run(self, field: Array, steps: list[float]) -> Array:
        grid, state = self._grid_layout.grid, self._state
        grid(state.position)[...] = self._undisturbed + self._small * field[0]
        grid(state.velocity)[...] = self._small / steps[0] * field[1]
        blocks = [SubstepBatch(1, h) for h in steps]
        for _ in self._method.run(state, blocks, lambda _: None, lambda _: False):
            pass
        moved = grid(state.position) - self._undisturbed
        return np.stack([moved, steps[0] * grid(state.velocity)])


def measured_limit(scene: Scene, positions: Array) -> float:
    """
    Return the longest step, s, with which a method is stable about a state, to one percent.

    Contact, air, drag and gravity are left out; inf if nothing ever grows.

    Parameters
    ----------
    scene
        Its springs, masses, pins and method.
    positions
        m, shape (rows, columns, 3).

    """
    scene = _springs_alone(scene)
    bound = scene.stability_limit()
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
    """Return positions about the centre, m, shape (rows, columns, 3), of states by name."""
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
    Return predicted and measured stability limits of a method in one of the `states` of a sheet.

    Of sheets with more than 24 rows or columns a piece of that size is measured: the same
    particles, springs and pins, without the rest.
    """
    scene = scene.with_parameters({'solver.method': method, 'solver.substeps': 0})
    piece = _piece(scene)
    positions = states(piece)[state]
    return StabilityComparison(
        state,
        piece.sheet.rows,
        piece.sheet.columns,
        stability_limit(piece, positions),
        scene.stability_limit(),
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
    """Return a scene with the first rows and columns of a sheet alone, as many as are measured."""
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
            'sheet.mass': sheet.particle_mass * rows * columns,
        }
    )
