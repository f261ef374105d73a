"""The cloth: a simulation that is looked at, and told what to do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..scene import Scene
from ..scene.parameter import PARAMETERS, checked_vector, invalid_value_error
from . import memory
from .contact.kinematic_path import CommandedMotion
from .energy import Energy, energy, largest_strain
from .grid import Array, flat_sheet, to_grid_copy
from .simulation import Simulation, require_scene


class Cloth(Simulation):
    """
    A running simulation of a scene, in its initial state at first.

    Parameters
    ----------
    scene
        What to simulate.
    finer
        Divides every substep that the scene, and the motion of its cloth, would take.

    """

    def __init__(self, scene: Scene, *, finer: int = 1) -> None:
        super().__init__(scene, finer=finer)
        self.reset()

    def adopt(self, other: Cloth) -> None:
        """
        Take over the state of another cloth of the same sheet, without what it was told.

        Raises
        ------
        ValueError
            Its sheet has another number of particles.

        """
        size = (other._grid_layout.rows, other._grid_layout.columns)
        if size != (own := (self._grid_layout.rows, self._grid_layout.columns)):
            raise invalid_value_error(
                'the sheet of the other cloth', size, f'of {own} particles', 'adopt such'
            )
        self._state.copy_from(other._state)
        self._state.velocity *= self._state.free
        self._time = other._time
        self._wind, self._sphere = other._wind, CommandedMotion(other.sphere_position)
        self._forget()
        if other._contact is None:
            self._respawn()
        elif self._contact is not None:
            self._contact.go_on_from(other._contact)

    def configure(self, scene: Scene) -> None:
        """
        Go on from the present state with another scene.

        Raises
        ------
        ValueError
            A parameter that is fixed while a cloth runs differs, or `scene` is none.

        """
        require_scene(scene)
        memory.check(scene, memory.of_cloth(scene))
        before, after = self._scene.flat(), scene.flat()
        for name, known in PARAMETERS.items():
            if known.fixed and before[name] != after[name]:
                raise invalid_value_error(
                    name, after[name], f'{before[name]!r} as before', 'make a new Cloth'
                )
        if scene.wind.velocity != self._scene.wind.velocity:
            self._wind = np.array(scene.wind.velocity)
        if scene.sphere.position != self._scene.sphere.position:
            if self._contact is None or scene.sphere.radius == 0:
                self._sphere = CommandedMotion(scene.sphere.position)
            else:
                self._sphere.waypoints = [np.array(scene.sphere.position)]
        self._build(scene)
        if self._contact is not None:
            self._contact.shrink_to_fit(self._state)

    def reset(self) -> None:
        """Go back to the initial state: sheet, wind, sphere and time."""
        sheet = self._scene.sheet
        self._state.origin = np.array(sheet.position)
        self._grid_layout.grid(self._state.position)[...] = flat_sheet(
            sheet.rows, sheet.columns, sheet.spacing, sheet.orientation
        )
        self._state.velocity[...] = 0
        self._state.acceleration[...] = 0
        self._time = self._done = 0.0
        self._substeps = 0
        self._wind = np.array(self._scene.wind.velocity)
        self._sphere = CommandedMotion(self._scene.sphere.position)
        self._forget()
        self._respawn()

    @property
    def positions(self) -> Array:
        """Positions, m, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return to_grid_copy(self._state.world)

    @positions.setter
    def positions(self, value: Array) -> None:
        self._state.world = self._grid_layout.checked('positions', value)
        self._forget()
        self._respawn()

    @property
    def velocities(self) -> Array:
        """Velocities, m/s, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return to_grid_copy(self._state.speeds)

    @velocities.setter
    def velocities(self, value: Array) -> None:
        grid = self._grid_layout.grid
        grid(self._state.velocity)[...] = self._grid_layout.checked('velocities', value)
        self._state.velocity *= self._state.free
        self._forget()

    def write_particles(self, out: Array) -> None:
        """Write x y z vx vy vz of every particle, m and m/s, to `out`, (rows, columns, 6)."""
        out[..., :3] = np.moveaxis(self._state.world, 0, -1)
        out[..., 3:] = np.moveaxis(self._grid_layout.grid(self._state.velocity), 0, -1)

    def write_positions(self, out: Array) -> None:
        """Write the position of every particle, m, to `out`, shape (rows, columns, 3)."""
        out[...] = np.moveaxis(self._grid_layout.grid(self._state.position), 0, -1)
        out += self._state.origin

    @property
    def wind(self) -> tuple[float, float, float]:
        """Commanded velocity of the air, m/s; gusts come on top.  Assign to command it."""
        x, y, z = self._wind.tolist()
        return (x, y, z)

    @wind.setter
    def wind(self, velocity: Sequence[float]) -> None:
        self._wind = checked_vector('wind', velocity, 'wind.velocity')

    @property
    def air_velocity(self) -> tuple[float, float, float]:
        """Velocity of the air now, gusts included, m/s."""
        x, y, z = (self._wind + self._gust()).tolist()
        return (x, y, z)

    @property
    def sphere_position(self) -> tuple[float, float, float]:
        """Centre of the sphere now, m."""
        x, y, z = self._sphere.centre.tolist()
        return (x, y, z)

    @property
    def sphere_radius(self) -> float:
        """Radius of the sphere now, m: one that has appeared in the sheet grows to its own."""
        return 0.0 if self._contact is None else self._contact.radius

    def move_sphere(self, position: Sequence[float]) -> None:
        """
        Sweep the sphere to `position`, m, which it reaches at the end of the next advance.

        Positions given one after the other before that are passed in their order.

        Raises
        ------
        ValueError
            The position is not finite or too far away, or the scene has no sphere.

        """
        if self._contact is None:
            raise invalid_value_error(
                'sphere.radius', 0.0, 'more than 0 to move a sphere', 'set it to its radius'
            )
        self._sphere.command(position, self._scene.sphere.radius, self._state.origin)

    @property
    def sphere_waypoints(self) -> list[Array]:
        """Positions commanded since the last advance, m, passed in the next; assign to set."""
        return list(self._sphere.waypoints)

    @sphere_waypoints.setter
    def sphere_waypoints(self, waypoints: Sequence[Sequence[float]] | Sequence[Array]) -> None:
        self._sphere.waypoints = [
            checked_vector('a waypoint', list(point), 'sphere.position') for point in waypoints
        ]

    @property
    def sphere_depth(self) -> float:
        """Greatest depth of a triangle in the sphere at the last contact, m; 0 if tolerable."""
        return 0.0 if self._contact is None else self._contact.max_penetration

    def energy(self) -> float:
        """Return kinetic, elastic and gravitational energy together, J."""
        return self.energy_by_kind().total

    def energy_by_kind(self) -> Energy:
        """Return the energy by kind, J; gravitational energy is zero at the world's origin."""
        return energy(self._state.world, self._state.speeds, self._scene)

    def largest_strain(self) -> float:
        """Return the largest relative change of length of any spring."""
        return largest_strain(self._state.world, self._scene)
