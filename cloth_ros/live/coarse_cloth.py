"""A cloth that is simulated on a coarser grid than it is shown on."""

from __future__ import annotations

import numpy as np

from ..model.cloth import Cloth
from ..model.grid import Array
from ..model.resample import interpolate, resample_scene
from ..scene import Scene
from ..scene.parameter import invalid_value_error

# Spacings that a pin may be moved by to be where it was at first.
_NEAR = 2.0


class CoarseCloth(Cloth):
    """
    A scene on a grid whose spacing is a multiple of its own; see `grids.on_grid`.

    What it says of positions and velocities is on the scene's own grid, linearly between the
    particles of the coarser one; energy, strain and substeps are those of the coarser one.

    Parameters
    ----------
    scene
        What to simulate.
    spacing
        Multiple of the scene's own spacing.

    Raises
    ------
    ValueError
        The grid would have fewer than three particles along a side.

    """

    def __init__(self, scene: Scene, spacing: float) -> None:
        self._shown = scene
        coarse = resample_scene(scene, 1 / spacing)
        if coarse is None:
            raise invalid_value_error(
                'spacing', spacing, 'less: three particles a side must remain', 'halve it'
            )
        super().__init__(coarse)

    @property
    def scene(self) -> Scene:
        """The scene, on its own grid."""
        return self._shown

    def _on_own_grid(self, field: Array) -> Array:
        sheet = self._shown.sheet
        there: Array = interpolate(field[None], sheet.rows, sheet.columns)[0]
        return there

    @property
    def positions(self) -> Array:
        """Positions, m, shape (rows, columns, 3) of the scene; assign those of any grid."""
        return self._on_own_grid(super().positions)

    @positions.setter
    def positions(self, value: Array) -> None:
        own = super().positions
        there = interpolate(np.asarray(value)[None], *own.shape[:2])[0]
        # Pins of the coarser grid are not quite where those of the scene are.
        pinned = self._scene.pinned()
        there[pinned] = own[pinned]
        Cloth.positions.fset(self, there)  # type: ignore[attr-defined]

    @property
    def velocities(self) -> Array:
        """Velocities, m/s, shape (rows, columns, 3) of the scene; assign those of any grid."""
        return self._on_own_grid(super().velocities)

    @velocities.setter
    def velocities(self, value: Array) -> None:
        grid = (self._grid_layout.rows, self._grid_layout.columns)
        there = interpolate(np.asarray(value)[None], *grid)[0]
        Cloth.velocities.fset(self, there)  # type: ignore[attr-defined]

    def write_particles(self, out: Array) -> None:
        """Write x y z vx vy vz of every particle, m and m/s, to `out`, (rows, columns, 6)."""
        out[..., :3], out[..., 3:] = self.positions, self.velocities

    def write_positions(self, out: Array) -> None:
        """Write the position of every particle, m, to `out`, shape (rows, columns, 3)."""
        out[...] = self.positions


def cloth_on(scene: Scene, spacing: float) -> Cloth:
    """Return a cloth on a grid of a multiple of the scene's own spacing; 1: on its own."""
    return Cloth(scene) if spacing == 1 else CoarseCloth(scene, spacing)


def _on_grid_of(cloth: Cloth, field: Array) -> Array:
    """Return a field, shape (3, rows, columns), on the grid that a cloth is simulated on."""
    grid = (cloth._grid_layout.rows, cloth._grid_layout.columns)
    there: Array = np.moveaxis(interpolate(np.moveaxis(field, 0, -1)[None], *grid)[0], -1, 0)
    return there


def take_over(cloth: Cloth, other: Cloth) -> None:
    """
    Have a new cloth go on from where another one of the same sheet is, whatever its grid.

    However far that is: a free sheet that has fallen for long is beyond what may be assigned from
    outside, and single precision resolves it only about the origin that it has taken along.
    """
    state, before, grid = cloth._state, other._state, cloth._grid_layout.grid
    flat = grid(state.position) + (state.origin - before.origin)[:, None, None]
    state.origin = before.origin
    there = _on_grid_of(cloth, other._grid_layout.grid(before.position))
    # Pins of the coarser grid are not quite where those of the scene are, and must not wander from
    # one grid to the next; those that were set while the cloth ran are where it was then.
    near = np.linalg.norm(there - flat, axis=0) < _NEAR * max(cloth._scene.sheet.spacing)
    grid(state.position)[...] = np.where(cloth._scene.pinned() & near, flat, there)
    grid(state.velocity)[...] = grid(state.free) * _on_grid_of(cloth, before.speeds)
    cloth._forget()
    cloth._time, cloth._wind, cloth._sphere = other._time, other._wind, other._sphere
    cloth._respawn()
    cloth._done, cloth._rollbacks = other._done, other._rollbacks
    cloth._energy_monitor.rollbacks = other._rollbacks
