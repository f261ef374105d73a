"""The cloth: a scene brought to life."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from . import contact
from .contact import SphereContact
from .dynamics import Dynamics
from .energy import Energy, energy, largest_strain
from .gusts import Gusts
from .lattice import Array, Lattice, flat_sheet
from .methods import METHODS
from .quantity import PARAMETER_NAMES, refuse
from .scene import Scene
from .state import State, greatest_speed
from .substeps import LOOK_EVERY, ROUNDING, refinement, substep_length

_DTYPES = {'single': np.float32, 'double': np.float64}


def checked_vector(name: str, vector: Sequence[float], parameter: str) -> Array:
    """
    Return a vector of three finite numbers as an array, shape (3,).

    Arguments:
    ---------
    name
        What the vector is, for the error.
    vector
        Three numbers.
    parameter
        Name of the scene parameter whose range holds for each of them.

    Raises
    ------
    ValueError
        The vector has not three numbers, or one is not finite or out of range.

    """
    limit = PARAMETER_NAMES[parameter]
    allowed = f'three finite numbers, each {limit.range_text}'
    try:
        array = np.array(vector, float)
    except (TypeError, ValueError, OverflowError):
        raise refuse(name, vector, allowed, 'correct it') from None
    if array.shape != (3,):
        raise refuse(name, vector, allowed, 'give x, y and z')
    if not np.all((limit.low <= array) & (array <= limit.high)):  # False for NaN
        raise refuse(name, array.tolist(), allowed, 'correct it')
    return array


class Cloth:
    """
    A running simulation of a scene.

    Attributes
    ----------
    coarse
        True to take the longest stable substeps, whatever the tolerance asks for.

    """

    def __init__(self, scene: Scene) -> None:
        if not isinstance(scene, Scene):
            raise refuse('scene', scene, 'a cloth_ros.Scene', 'use Scene(...) or Scene.from_yaml')
        self.coarse = False
        self._lattice = Lattice(scene.sheet.rows, scene.sheet.columns)
        self._origin = np.array(scene.sheet.position)[:, None, None]
        self._state = State(self._lattice, _DTYPES[scene.solver.precision])
        self._wind = np.zeros(3)
        self._air = np.zeros(3)
        self._contact: SphereContact | None = None
        self._sphere = np.zeros(3)
        self._build(scene)
        self.reset()

    def _build(self, scene: Scene) -> None:
        """Make what a scene requires, around the present state."""
        self._scene = scene
        dtype = _DTYPES[scene.solver.precision]
        if self._state.dtype is not dtype:
            self._convert(dtype)
        self._state.pin(scene.pinned())
        self._gusts = Gusts(scene.wind.gust) if scene.wind.gust.period > 0 else None
        self._contact = None
        if scene.sphere.radius > 0:
            centre = self._sphere - self._origin[:, 0, 0]
            self._contact = SphereContact(scene.sphere, self._lattice, centre)
        self._dynamics = Dynamics(scene, self._lattice, self._air, dtype)
        name = scene.solver.method
        method = METHODS['symplectic_euler' if name == 'auto' else name]
        self._method = method(self._dynamics)
        self._stability_limit = scene.stability_limit()

    def _convert(self, dtype: type) -> None:
        before, self._state = self._state, State(self._lattice, dtype)
        grid = self._lattice.grid
        grid(self._state.position)[...] = grid(before.position)
        grid(self._state.velocity)[...] = grid(before.velocity)

    def configure(self, scene: Scene) -> None:
        """
        Go on from the present state with another scene.

        Raises
        ------
        ValueError
            A parameter that is fixed while a cloth runs differs.

        """
        before, after = self._scene.flat(), scene.flat()
        for name, known in PARAMETER_NAMES.items():
            if known.fixed and before[name] != after[name]:
                raise refuse(name, after[name], f'{before[name]!r} as before', 'make a new Cloth')
        if scene.wind.velocity != self._scene.wind.velocity:
            self._wind = np.array(scene.wind.velocity)
        if scene.sphere.position != self._scene.sphere.position:
            self._sphere_target = np.array(scene.sphere.position)
            if self._contact is None:
                self._sphere = self._sphere_target
        self._build(scene)

    def reset(self) -> None:
        """Go back to the initial state: sheet, wind, sphere and time."""
        sheet = self._scene.sheet
        grid = self._lattice.grid
        grid(self._state.position)[...] = flat_sheet(
            sheet.rows, sheet.columns, sheet.spacing, sheet.orientation
        )
        self._state.velocity[...] = 0
        self._state.acceleration[...] = 0
        self._time = 0.0
        self._substeps = 0
        self._wind = np.array(self._scene.wind.velocity)
        self._sphere = np.array(self._scene.sphere.position)
        self._sphere_target = self._sphere
        if self._contact is not None:
            self._contact.centre = self._sphere - self._origin[:, 0, 0]
            self._contact.forget()

    @property
    def scene(self) -> Scene:
        """The scene that is simulated."""
        return self._scene

    @property
    def time(self) -> float:
        """Simulated time since the start or the last reset, s."""
        return self._time

    @property
    def stability_limit(self) -> float:
        """Longest stable substep, s, for every state of the cloth; inf without springs."""
        return self._stability_limit

    @property
    def substep(self) -> float:
        """Length of the substeps, s; a whole number of them makes a tick of the scene's rate."""
        return substep_length(self._scene, self._stability_limit, coarse=self.coarse)

    @property
    def substeps(self) -> int:
        """Number of substeps of the last advance, those of violent motion included."""
        return self._substeps

    @property
    def error_estimate(self) -> float:
        """
        Estimate of the present position error by the substep, m.

        Half a substep times the greatest speed: the shift in time that is the leading error of
        symplectic Euler.
        """
        speeds = np.linalg.norm(self._lattice.grid(self._state.velocity), axis=0)
        return 0.5 * self.substep * float(speeds.max())

    def _world(self) -> Array:
        world: Array = self._lattice.grid(self._state.position) + self._origin
        return world

    @staticmethod
    def _public(array: Array) -> Array:
        public: Array = np.ascontiguousarray(np.moveaxis(array, 0, -1))
        public.flags.writeable = False  # a copy: writing to it would be lost without a word
        return public

    def _checked(self, name: str, value: Array) -> Array:
        shape = (self._lattice.rows, self._lattice.columns, 3)
        array = np.asarray(value, float)
        if array.shape != shape or not np.all(np.abs(array) <= 1e9):
            raise refuse(name, array.shape, f'finite, of shape {shape}', 'correct the array')
        return np.moveaxis(array, -1, 0)

    @property
    def positions(self) -> Array:
        """Positions, m, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return self._public(self._world())

    @positions.setter
    def positions(self, value: Array) -> None:
        array = self._checked('positions', value) - self._origin
        self._lattice.grid(self._state.position)[...] = array
        self._forget_contact()

    @property
    def velocities(self) -> Array:
        """Velocities, m/s, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return self._public(self._lattice.grid(self._state.velocity).astype(float))

    @velocities.setter
    def velocities(self, value: Array) -> None:
        grid = self._lattice.grid
        grid(self._state.velocity)[...] = self._checked('velocities', value)
        self._state.velocity *= self._state.free
        self._forget_contact()

    def write_particles(self, out: Array) -> None:
        """Write x y z vx vy vz of every particle, m and m/s, to `out`, (rows, columns, 6)."""
        grid = self._lattice.grid
        out[..., :3] = np.moveaxis(grid(self._state.position) + self._origin, 0, -1)
        out[..., 3:] = np.moveaxis(grid(self._state.velocity), 0, -1)

    def write_positions(self, out: Array) -> None:
        """Write the position of every particle, m, to `out`, shape (rows, columns, 3)."""
        out[...] = np.moveaxis(self._lattice.grid(self._state.position), 0, -1)
        out += self._origin[:, 0, 0]

    def _forget_contact(self) -> None:
        if self._contact is not None:
            self._contact.forget()

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

    def _gust(self) -> Array:
        return np.zeros(3) if self._gusts is None else self._gusts.velocity(self._time)

    @property
    def sphere_position(self) -> tuple[float, float, float]:
        """Centre of the sphere now, m."""
        x, y, z = self._sphere.tolist()
        return (x, y, z)

    def move_sphere(self, position: Sequence[float]) -> None:
        """
        Sweep the sphere to `position`, m, which it reaches at the end of the next advance.

        Raises
        ------
        ValueError
            The position is not finite or too far away, or the scene has no sphere.

        """
        if self._contact is None:
            raise refuse(
                'sphere.radius', 0.0, 'more than 0 to move a sphere', 'set it to its radius'
            )
        self._sphere_target = checked_vector('sphere position', position, 'sphere.position')

    @property
    def sphere_depth(self) -> float:
        """Greatest depth of a triangle in the sphere at the last contact, m."""
        return 0.0 if self._contact is None else self._contact.deepest

    def advance(self, seconds: float) -> None:
        """
        Simulate the next `seconds`, in equal substeps no longer than `substep`.

        Fast motion divides them further, see `substeps.refinement`.

        Raises
        ------
        ValueError
            `seconds` is negative or not finite.
        FloatingPointError
            The state would not be finite; the cloth is then left as it was before.

        """
        seconds = float(seconds)
        if not 0 <= seconds < math.inf:
            raise refuse('seconds', seconds, 'finite and not negative', 'correct it')
        if seconds == 0:
            return
        count = max(math.ceil(seconds / self.substep - ROUNDING), 1)
        before = (self._state.position.copy(), self._state.velocity.copy(), self._time)
        if self._contact is not None:
            self._contact.centre = self._sphere - self._origin[:, 0, 0]
            self._contact.velocity = (self._sphere_target - self._sphere) / seconds
        self._substeps = 0
        h = seconds / count
        for first in range(0, count, LOOK_EVERY):
            fine = refinement(self._scene, h, greatest_speed(self._state))
            self._run(fine * min(LOOK_EVERY, count - first), h / fine)
        if not np.isfinite(self._state.velocity).all():
            self._state.position, self._state.velocity, self._time = before
            self._forget_contact()
            raise FloatingPointError(
                f'the state after {seconds:g} s would not be finite; the cloth stays as it was '
                f'at {self._time:g} s'
            )
        self._time = before[2] + seconds
        self._sphere = self._sphere_target

    def _run(self, count: int, h: float) -> None:
        """Simulate `count` substeps of `h` s."""
        self._air[:] = self._wind
        for _ in range(count):
            if self._gusts is not None:
                self._air[:] = self._wind + self._gusts.velocity(self._time)
            self._method.step(self._state, h)
            if self._contact is not None:
                self._contact.resolve(self._state, h)
            self._time += h
        self._substeps += count

    def energy(self) -> float:
        """Return kinetic, elastic and gravitational energy together, J."""
        return self.energy_by_kind().total

    def energy_by_kind(self) -> Energy:
        """Return the energy by kind, J; gravitational energy is zero at the world's origin."""
        velocities = self._lattice.grid(self._state.velocity).astype(float)
        return energy(self._world(), velocities, self._scene)

    def largest_strain(self) -> float:
        """Return the largest relative change of length of any spring."""
        return largest_strain(self._world(), self._scene)

    def compile(self) -> None:
        """Compile every kernel that the scene uses, and leave the state as it is."""
        position, velocity = self._state.position.copy(), self._state.velocity.copy()
        self._method.step(self._state, 0.0)
        self._state.position[...], self._state.velocity[...] = position, velocity
        if self._contact is not None:
            contact.warm_up(self._state.dtype)
