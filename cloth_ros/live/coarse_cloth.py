"""A cloth that is simulated on a coarser grid than it is published on."""

from __future__ import annotations

from collections.abc import Mapping

from ..model import Cloth, Snapshot
from ..model.contact.collider import Collider
from ..model.grid import Array
from ..model.grippers.gripper import Gripper
from ..model.resample import interpolate, resample_scene
from ..scene import Scene
from ..scene.parameter import invalid_value_error


def simulated_scene(scene: Scene, spacing: int) -> Scene:
    """
    Return a scene on a grid whose spacing is a multiple of its own; 1: the scene itself.

    Raises
    ------
    ValueError
        The grid would have fewer than three particles along a side.

    """
    coarse = resample_scene(scene, 1 / spacing)
    if coarse is None:
        raise invalid_value_error(
            'spacing', spacing, 'less: three particles a side must remain', 'halve it'
        )
    return coarse


class CoarseCloth:
    """
    Simulate a scene on a coarser grid; publish positions and velocities on the scene's own.

    Between the particles of the coarser grid they are interpolated linearly.  With a spacing of 1
    both grids are the same.

    Parameters
    ----------
    scene
        What to publish.
    spacing
        Multiple of the scene's own spacing.
    former
        A cloth with the same sheet, on any grid, to continue from; None: the initial state.

    Attributes
    ----------
    scene
        The scene on its own grid.
    spacing
        As above.
    cloth
        The cloth that is simulated.

    Raises
    ------
    ValueError
        The grid would have fewer than three particles along a side.

    """

    def __init__(self, scene: Scene, spacing: int = 1, former: Cloth | None = None) -> None:
        self.scene = scene
        self.spacing = spacing
        rollbacks = None if former is None else former.rollbacks
        self.cloth = Cloth(simulated_scene(scene, spacing), rollbacks=rollbacks)
        if former is not None:
            self.cloth.restore(former.snapshot())

    def changed(self, scene: Scene, spacing: int) -> CoarseCloth:
        """
        Return a cloth with another scene of the same sheet, or on another grid, that continues.

        It may be this one, changed.  Commands that follow from changed parameters, such as that of
        another wind, are given before the grid is changed.
        """
        if (coarse := resample_scene(scene, 1 / self.spacing)) is not None:
            self.cloth.configure(coarse)
        if spacing == self.spacing:
            self.scene = scene
            return self
        return CoarseCloth(scene, spacing, self.cloth)

    def snapshot(self, scene: Scene) -> Snapshot:
        """Return the state on the grid, and with the parameters, of a scene of the same sheet."""
        if self.cloth.scene == scene:
            return self.cloth.snapshot()
        cloth = Cloth(scene)
        cloth.restore(self.cloth.snapshot())
        return cloth.snapshot()

    @property
    def air_velocity(self) -> tuple[float, float, float]:
        """Velocity of the air now, gusts included, m/s."""
        return self.cloth.air_velocity

    @property
    def colliders(self) -> Mapping[str, Collider]:
        """Colliders by name."""
        return self.cloth.colliders

    @property
    def grippers(self) -> Mapping[str, Gripper]:
        """Grippers by name; they hold particles of the grid that is simulated."""
        return self.cloth.grippers

    def _on_own_grid(self, field: Array) -> Array:
        sheet = self.scene.sheet
        fine: Array = interpolate(field[None], sheet.rows, sheet.columns)[0]
        return fine

    @property
    def positions(self) -> Array:
        """Positions, m, shape (rows, columns, 3) of the scene's own grid."""
        positions = self.cloth.positions
        return positions if self.spacing == 1 else self._on_own_grid(positions)

    @property
    def velocities(self) -> Array:
        """Velocities, m/s, shape (rows, columns, 3) of the scene's own grid."""
        velocities = self.cloth.velocities
        return velocities if self.spacing == 1 else self._on_own_grid(velocities)

    def write_particles(self, out: Array) -> None:
        """Write x y z vx vy vz of every particle, m and m/s, to `out`, (rows, columns, 6)."""
        if self.spacing == 1:
            self.cloth.write_particles(out)
        else:
            out[..., :3], out[..., 3:] = self.positions, self.velocities

    def write_positions(self, out: Array) -> None:
        """Write the position of every particle, m, to `out`, shape (rows, columns, 3)."""
        if self.spacing == 1:
            self.cloth.write_positions(out)
        else:
            out[...] = self.positions
