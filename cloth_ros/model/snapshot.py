"""Immutable copy of a simulation: everything that later results depend on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..scene import Scene
from .contact.contact_snapshot import ContactSnapshot
from .energy_monitor import EnergyAccount
from .grid import GHOST, Array, Grid, flat_sheet
from .grippers.grippers import GrippersSnapshot, on_other_grid
from .inputs import Inputs
from .resample import interpolate
from .step_control import StepAccount

# Distance, in spacings, within which a pin counts as still being at its initial position.
_NEAR = 2.0


@dataclass(frozen=True, slots=True)
class Snapshot:
    """
    State of a cloth between two advances.

    After `restore`, the same advance with the same inputs gives the same bits.  Copies to another
    precision, grid or scene, roll-back and the finer solution of the error estimate use it too.

    Attributes
    ----------
    scene
        Parameters of the cloth.
    grid
        Layout of the arrays.
    origin
        Origin of the positions, m, shape (3,).
    position, velocity
        m from `origin` and m/s, shape (3, size), in the precision of the cloth.
    time
        Simulated time, s.
    work
        Of air, colliders and grippers since the start, J.
    contact
        Snapshot of the colliders; None: the scene has none.
    account
        State of the energy monitor; None if it has not measured yet, or there is none.
    inputs
        Commands that hold for the next advance.
    grippers
        Snapshots of the grippers by name; None: the scene has none.
    steps
        State of the step control; None: it has none.
    pace
        Of self-contact, see `SelfContact.pace`.

    """

    scene: Scene
    grid: Grid
    origin: Array
    position: Array
    velocity: Array
    time: float
    work: float
    contact: ContactSnapshot | None
    account: EnergyAccount | None
    inputs: Inputs
    grippers: GrippersSnapshot | None = None
    steps: StepAccount | None = None
    pace: tuple[int, int] = (1, 0)

    def of_scene(self, scene: Scene) -> Snapshot:
        """
        Return the same state for a scene with the same sheet, whose parameters may differ.

        Colliders and grippers that the scene does not have are left out.
        """
        contact, parameters = self.contact, {each.name: each for each in scene.all_colliders()}
        if contact is not None:
            colliders = {
                name: each._replace(parameters=parameters[name])
                for name, each in contact.colliders.items()
                if name in parameters
            }
            contact = contact._replace(colliders=colliders)
        return replace(self, scene=scene, contact=contact, grippers=self._grippers_of(scene))

    def _grippers_of(self, scene: Scene) -> GrippersSnapshot | None:
        if self.grippers is None:
            return None
        parameters = {each.name: each for each in scene.grippers}
        grippers = {
            name: each._replace(parameters=parameters[name])
            for name, each in self.grippers.items()
            if name in parameters
        }
        return grippers or None

    def resampled(self, scene: Scene) -> Snapshot:
        """
        Return this state on the grid of another scene, linearly between its own particles.

        A pin that is near its initial position is placed there exactly: it must not move when
        grids are changed.  Pins that were set while the cloth ran stay where the cloth was.
        """
        sheet = scene.sheet
        grid = Grid(sheet.rows, sheet.columns)
        initial = flat_sheet(sheet.rows, sheet.columns, sheet.spacing, sheet.orientation)
        initial += (np.array(sheet.position) - self.origin)[:, None, None]
        there = self._on_grid(self.position, grid)
        near = np.linalg.norm(there - initial, axis=0) < _NEAR * max(sheet.spacing)
        position, velocity = grid.field(float, GHOST), grid.field(float)
        grid.interior(position)[...] = np.where(scene.pinned() & near, initial, there)
        grid.interior(velocity)[...] = self._on_grid(self.velocity, grid)
        grippers = self.grippers
        if grippers is not None:
            places = grid.interior(position) + self.origin[:, None, None]
            grippers = on_other_grid(grippers, self.grid, grid, places, scene.pinned())
        return replace(
            self, scene=scene, grid=grid, position=position, velocity=velocity, grippers=grippers
        )

    def _on_grid(self, field: Array, grid: Grid) -> Array:
        """Return a flat field on another grid, shape (3, rows, columns)."""
        samples = np.moveaxis(self.grid.interior(field), 0, -1)[None]
        there: Array = np.moveaxis(interpolate(samples, grid.rows, grid.columns)[0], -1, 0)
        return there
