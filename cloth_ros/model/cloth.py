"""The cloth: a scene brought to life."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence

import numpy as np

from . import contact
from .contact import SphereContact
from .dynamics import Dynamics
from .energy import Energy, energy, largest_strain
from .gusts import Gusts
from .lattice import Array, Lattice, flat_sheet, read_only
from .methods.steps import Block
from .quantity import PARAMETER_NAMES, checked_vector, refuse
from .scene import Scene
from .sphere_path import SphereMotion
from .state import State, greatest_speed
from .substeps import (
    LOOK_EVERY,
    ROUNDING,
    dissipation_spacing,
    method_for,
    precision_for,
    refinement,
    substep_length,
)

_DTYPES = {'single': np.float32, 'double': np.float64}

_LONGEST = 1e6  # s, of one advance
_TIMED = LOOK_EVERY  # substeps to tell their cost from


class Cloth:
    """
    A running simulation of a scene.

    Parameters
    ----------
    scene
        What to simulate.
    finer
        Divides every substep that the scene, and the motion of its cloth, would take.
    """

    def __init__(self, scene: Scene, *, finer: int = 1) -> None:
        if not isinstance(scene, Scene):
            raise refuse('scene', scene, 'a cloth_ros.Scene', 'use Scene(...) or Scene.from_yaml')
        self._finer = finer
        self._look = LOOK_EVERY if finer == 1 else 1  # twins run in pauses, which are short
        self._lattice = Lattice(scene.sheet.rows, scene.sheet.columns)
        self._origin = np.zeros((3, 1, 1))
        self._state = State(self._lattice, _DTYPES[precision_for(scene)])
        self._wind = np.zeros(3)
        self._air = np.zeros(3)
        self._contact: SphereContact | None = None
        self._time = 0.0
        self._sphere = SphereMotion(scene.sphere.position)
        self._build(scene)
        self.reset()

    def _build(self, scene: Scene) -> None:
        """Make what a scene requires, around the present state."""
        self._scene = scene
        dtype = _DTYPES[precision_for(scene)]
        if self._state.dtype is not dtype:
            before, self._state = self._state, State(self._lattice, dtype)
            self._copy(before)
        pinned = scene.pinned()
        self._pinned = bool(pinned.any())
        self._state.pin(pinned)
        self._gusts = Gusts(scene.wind.gust) if scene.wind.gust.period > 0 else None
        self._contact = None
        if scene.sphere.radius > 0:
            centre = self._sphere.centre - self._origin[:, 0, 0]
            self._contact = SphereContact(scene.sphere, self._lattice, centre)
        self._dynamics = Dynamics(scene, self._lattice, self._air, dtype)
        self._method = method_for(scene)(self._dynamics)
        self._substep = substep_length(scene)
        self._stability_limit = scene.stability_limit()
        self._viscous = scene.rate_bounds()[1]

    def _copy(self, state: State) -> None:
        grid = self._lattice.grid
        grid(self._state.position)[...] = grid(state.position)
        grid(self._state.velocity)[...] = grid(state.velocity)

    def adopt(self, other: Cloth) -> None:
        """Take over the state of another cloth of the same sheet, without what it was told."""
        self._copy(other._state)
        self._origin, self._time = other._origin, other._time
        self._wind, self._sphere = other._wind, SphereMotion(other.sphere_position)
        self._forget_contact()

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
            if self._contact is None:
                self._sphere = SphereMotion(scene.sphere.position)
            else:
                self._sphere.waypoints = [np.array(scene.sphere.position)]
        self._build(scene)

    def reset(self) -> None:
        """Go back to the initial state: sheet, wind, sphere and time."""
        sheet = self._scene.sheet
        grid = self._lattice.grid
        self._origin = np.array(sheet.position)[:, None, None]
        grid(self._state.position)[...] = flat_sheet(
            sheet.rows, sheet.columns, sheet.spacing, sheet.orientation
        )
        self._state.velocity[...] = 0
        self._state.acceleration[...] = 0
        self._time = 0.0
        self._substeps = 0
        self._wind = np.array(self._scene.wind.velocity)
        self._sphere = SphereMotion(self._scene.sphere.position)
        if self._contact is not None:
            self._contact.centre = self._sphere.centre - self._origin[:, 0, 0]
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
        return self._substep

    @property
    def substeps(self) -> int:
        """Number of substeps of the last advance, those of violent motion included."""
        return self._substeps

    def _world(self) -> Array:
        world: Array = self._lattice.grid(self._state.position) + self._origin
        return world

    @property
    def positions(self) -> Array:
        """Positions, m, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return read_only(self._world())

    @positions.setter
    def positions(self, value: Array) -> None:
        array = self._lattice.checked('positions', value) - self._origin
        self._lattice.grid(self._state.position)[...] = array
        self._forget_contact()

    @property
    def velocities(self) -> Array:
        """Velocities, m/s, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return read_only(self._lattice.grid(self._state.velocity).astype(float))

    @velocities.setter
    def velocities(self, value: Array) -> None:
        grid = self._lattice.grid
        grid(self._state.velocity)[...] = self._lattice.checked('velocities', value)
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
        x, y, z = self._sphere.centre.tolist()
        return (x, y, z)

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
            raise refuse(
                'sphere.radius', 0.0, 'more than 0 to move a sphere', 'set it to its radius'
            )
        self._sphere.command(position, self._scene.sphere.radius, self._origin[:, 0, 0])

    @property
    def sphere_waypoints(self) -> list[Array]:
        """Positions commanded since the last advance, m, which the sphere passes in the next."""
        return list(self._sphere.waypoints)

    @property
    def sphere_depth(self) -> float:
        """Greatest depth of a triangle in the sphere at the last contact, m; 0 if tolerable."""
        return 0.0 if self._contact is None else self._contact.deepest

    def advance(self, seconds: float) -> None:
        """
        Simulate the next `seconds`, in equal substeps no longer than `substep`.

        Fast motion divides them further, see `substeps.refinement`.

        Raises
        ------
        ValueError
            `seconds` is negative, not finite, or more than a million.
        FloatingPointError
            The state would not be finite; the cloth is then left as it was before.

        """
        for _ in self.march(seconds):
            pass

    def march(self, seconds: float) -> Iterator[None]:
        """
        Advance as `advance` does, but pause after each substep for whoever iterates.

        The cloth must be left alone until the iteration is over; positions and velocities do not
        belong to one time before.
        """
        seconds = float(seconds)
        if not 0 <= seconds <= _LONGEST:
            raise refuse('seconds', seconds, f'0 to {_LONGEST:g} s', 'advance in parts')
        if seconds == 0:
            return
        before = (self._state.position.copy(), self._state.velocity.copy(), self._time)
        origin = self._origin
        if self._contact is not None:
            self._contact.centre = self._sphere.centre - self._origin[:, 0, 0]
            self._sphere.begin(self._time, seconds)
        self._substeps = 0
        end = self._time + seconds
        while self._time < end:
            begin, change = self._time, end
            self._air[:] = self._wind
            if self._gusts is not None:
                change = min(end, self._gusts.next_change(begin))
                self._air += self._gusts.velocity(0.5 * (begin + change))
            blocks = self._blocks(change - begin)
            yield from self._method.run(self._state, blocks, self._moved, self._watched)
            self._time = change
        if not np.isfinite(self._state.velocity).all():
            self._state.position, self._state.velocity, self._time = before
            self._origin = origin
            self._forget_contact()
            raise FloatingPointError(
                f'the state after {seconds:g} s would not be finite; the cloth stays as it was '
                f'at {self._time:g} s'
            )
        if self._contact is not None:
            self._sphere.end()

    def _watched(self, block: Block) -> bool:
        """Tell if the sphere may act on the sheet between two substeps of a block."""
        if self._contact is None:
            return False
        return not self._contact.is_clear(
            self._state, block.substeps * block.h, self._sphere.speed
        )

    def _blocks(self, seconds: float) -> Iterator[Block]:
        """Yield the blocks of substeps of `seconds` in which the air does not change."""
        count = max(math.ceil(seconds / self.substep - ROUNDING), 1)
        h = seconds / count
        for first in range(0, count, self._look):
            self._follow()
            speed = greatest_speed(self._state)
            fine = self._finer * refinement(self._scene, h, speed)
            airspeed = speed + float(np.linalg.norm(self._air))
            spacing = dissipation_spacing(self._scene, h / fine, self._viscous, airspeed)
            for _ in range(fine):
                part = min(self._look, count - first)
                self._substeps += part
                yield Block(part, h / fine, spacing)

    def _moved(self, h: float) -> None:
        """Let the sphere, on its path, act on particles that have drifted for `h` s."""
        if self._contact is not None:
            self._contact.velocity = self._sphere.velocity(self._time, h)
            self._contact.resolve(self._state, h)
        self._time += h

    def _follow(self) -> None:
        """
        Move the origin of the flat arrays along with a sheet that has strayed from it.

        Single precision would otherwise resolve it ever less.  With a pin it cannot stray, and
        the pin must not move by one bit.
        """
        if self._pinned:
            return
        strayed = self._state.position[:, self._lattice.begin].astype(float)
        if 4 * (1 + self._scene.sheet.diagonal) < np.abs(strayed).max() < np.inf:
            shift = np.round(strayed)[:, None, None]
            self._lattice.grid(self._state.position)[...] -= shift.astype(self._state.dtype)
            self._origin = self._origin + shift
            if self._contact is not None:
                self._contact.centre = self._contact.centre - shift[:, 0, 0]

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

    def warm_up(self) -> Iterator[str]:
        """Compile what the scene uses, and say before each kernel what it is for."""
        yield 'motion'
        self._idle(1)
        greatest_speed(self._state)
        if self._contact is not None:
            yield 'contact'
            contact.warm_up(self._state.dtype)

    def compile(self) -> float:
        """Warm up, and return the wall-clock time of a substep without contact, s."""
        list(self.warm_up())
        return min(self._idle(_TIMED) for _ in range(3)) / _TIMED

    def _idle(self, count: int) -> float:
        """Make `count` substeps of no length; return the wall-clock time, s, that they took."""
        position, velocity = self._state.position.copy(), self._state.velocity.copy()
        spacing = dissipation_spacing(self._scene, self.substep, self._viscous, 0.0)
        blocks = [Block(count, 0.0, spacing)]
        start = time.perf_counter()
        for _ in self._method.run(self._state, blocks, lambda _: None, lambda _: False):
            pass
        seconds = time.perf_counter() - start
        self._state.position[...], self._state.velocity[...] = position, velocity
        return seconds
