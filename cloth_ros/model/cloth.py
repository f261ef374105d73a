"""Public interface of the model: read the state, set the inputs, advance."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

import numpy as np

from ..scene import Scene
from ..scene.parameter import checked_number, invalid_value_error
from . import snapshot_file
from .commands import Commands
from .contact.interfaces import Observer
from .contact.rigid_collider import RigidCollider
from .energy import Energy, energy
from .energy_monitor import EnergyMonitor, RollbackCounts
from .grid import Array, to_grid_copy
from .grippers.gripper import Gripper
from .inputs import Inputs, Vector, inputs_for
from .scene_check import check_change, check_scene
from .self_contact.self_contact import SelfContact
from .simulation import MAX_SECONDS, Simulation
from .snapshot import Snapshot
from .step_control import AdaptiveStepControl, StepControl
from .strain import Strain, strain
from .time_step import stability_limit


class Cloth:
    """
    A cloth, at first in the initial state of its scene.

    >>> cloth = Cloth(Scene(sheet={'rows': 24, 'columns': 24, 'size': (1.0, 1.0)}))  # m
    >>> cloth.wind = (0.0, 2.0, 0.0)  # m/s
    >>> cloth.advance(0.5)  # s
    >>> cloth.positions.shape  # m; rows, columns, and x y z
    (24, 24, 3)

    Lengths are in m, times in s, masses in kg, energies in J; frames follow REP 103, z upwards.

    Parameters
    ----------
    scene
        Parameters.
    step_control
        Makes the step control of a scene.
    energy_monitor
        Makes the energy monitor of a scene; None: no batch is ever rejected.
    observer
        Receives every substep; None: nothing does.
    rollbacks
        Counts to continue, of a cloth that this one replaces; None: from zero.

    Raises
    ------
    ValueError
        The scene cannot be simulated, see `check_scene`.

    """

    def __init__(
        self,
        scene: Scene,
        *,
        step_control: Callable[[Scene], StepControl] = AdaptiveStepControl,
        energy_monitor: Callable[[Scene, type], EnergyMonitor] | None = EnergyMonitor,
        observer: Observer | None = None,
        rollbacks: RollbackCounts | None = None,
    ) -> None:
        check_scene(scene)
        self._step_control, self._energy_monitor = step_control, energy_monitor
        self._observer = observer
        self._rollbacks = RollbackCounts() if rollbacks is None else rollbacks
        self._start(scene)

    def _start(self, scene: Scene) -> None:
        self._simulation = self._simulation_of(scene)
        self._simulation.start()
        self._commands = Commands(self._simulation, Inputs(scene.wind.velocity))

    def _simulation_of(self, scene: Scene) -> Simulation:
        return Simulation(
            scene, self._step_control(scene), self._energy_monitor, self._observer, self._rollbacks
        )

    # Advance

    def advance(self, seconds: float, inputs: Inputs | None = None) -> None:
        """
        Simulate the next `seconds`, in equal substeps no longer than `substep`.

        Substeps are divided further in fast motion, and where the energy monitor rejects a batch.

        Parameters
        ----------
        seconds
            Simulated time, s.
        inputs
            Wind, which then holds, and other commands; None: those given before.

        Raises
        ------
        ValueError
            `seconds` is negative, not finite, or more than a million; or `inputs` has a command
            to a collider or a gripper that there is not.

        """
        for _ in self.advance_stepwise(seconds, inputs):
            pass

    def advance_stepwise(self, seconds: float, inputs: Inputs | None = None) -> Iterator[None]:
        """
        Advance as `advance` does, but pause after each batch of substeps.

        Until the iteration is over or closed, positions and velocities do not belong to one time.
        Closed half-way, the cloth is left at the last accepted batch.
        """
        inputs = self.inputs if inputs is None else inputs
        self._commands.check(inputs)
        seconds = checked_number('seconds', seconds, 0.0, MAX_SECONDS, 's')
        steps = self._simulation.advance_stepwise(seconds, inputs)
        return self._take_inputs(steps, self.time + seconds > self.time, inputs)

    def _take_inputs(self, steps: Iterator[None], moves: bool, inputs: Inputs) -> Iterator[None]:
        if moves and (inputs.are_events or inputs is not self.inputs):
            # Not in an advance of zero: its waypoints are for the next one.
            self._commands.inputs = Inputs(inputs.wind)
        yield from steps

    def reset(self) -> None:
        """Return to the initial state: sheet, wind, colliders, time, and all grippers open."""
        self._start(self.scene)

    def configure(self, scene: Scene) -> None:
        """
        Continue from the present state with the parameters of another scene.

        A collider or gripper whose pose as a parameter has changed moves there in the next
        advance.

        Raises
        ------
        ValueError
            A fixed parameter differs, or the scene cannot be simulated.

        """
        check_change(self.scene, scene)
        inputs = inputs_for(self.inputs, self.scene, scene)
        simulation = self._simulation_of(scene)
        simulation.restore(self.snapshot())
        simulation.substeps = self.substeps
        self._simulation, self._commands = simulation, Commands(simulation, inputs)

    def snapshot(self) -> Snapshot:
        """Return an immutable copy of everything that later results depend on."""
        return self._simulation.snapshot(self.inputs)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot; that of another scene is converted in precision and grid."""
        self._simulation.restore(snapshot)
        self._commands = Commands(self._simulation, snapshot.inputs)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a snapshot to a file, which is replaced at once or not at all; raises OSError."""
        snapshot_file.write(path, self.snapshot())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Cloth:
        """
        Return a cloth that continues from a file of `save`, with the same bits.

        Raises
        ------
        ValueError, OSError
            The file is not one of `save`, is damaged, or cannot be read or simulated.

        """
        snapshot = snapshot_file.read(path)
        cloth = cls(snapshot.scene)
        cloth.restore(snapshot)
        return cloth

    # Inputs

    @property
    def inputs(self) -> Inputs:
        """Commands for the next advance: wind, waypoints of colliders and grippers, grasps."""
        return self._commands.inputs

    @property
    def wind(self) -> Vector:
        """Commanded velocity of the air, m/s; gusts are added to it.  Assign to command it."""
        return self.inputs.wind

    @wind.setter
    def wind(self, velocity: Sequence[float]) -> None:
        self._commands.inputs = self.inputs.with_wind(velocity)

    @property
    def air_velocity(self) -> Vector:
        """Velocity of the air now, gusts included, m/s."""
        return self._simulation.air_velocity(self.inputs.wind)

    def move_collider(
        self,
        name: str,
        position: Sequence[float],
        orientation: Sequence[float] | None = None,
    ) -> None:
        """
        Move a collider to a pose, which it reaches at the end of the next advance.

        Poses given one after the other before that are passed in their order; of more than 64,
        the last one and others that are spread evenly along the path.  The position is that of its
        origin, m, and the orientation a quaternion x y z w of any length but 0; None: it does not
        turn.  Raises ValueError for an invalid pose, or if there is no such collider.
        """
        self._commands.move_collider(name, position, orientation)

    def move_sphere(self, position: Sequence[float]) -> None:
        """Move the sphere; see `move_collider`."""
        if 'sphere' not in self.colliders:
            allowed, remedy = 'more than 0 to move a sphere', 'set it to its radius'
            raise invalid_value_error('sphere.radius', 0.0, allowed, remedy)
        self.move_collider('sphere', position)

    def move_gripper(
        self,
        name: str,
        position: Sequence[float],
        orientation: Sequence[float] | None = None,
    ) -> None:
        """Move a gripper to a pose, with what it holds; see `move_collider`."""
        self._commands.move_gripper(name, position, orientation)

    def grasp(self, name: str) -> int:
        """
        Let a gripper take what is within its radius, where it is now, at the next advance.

        Particles that are pinned, or that another gripper holds, stay so; what it holds already
        remains.  Returns the number of particles that it will hold.  Raises ValueError if there is
        none, which says how far the nearest is, or if there is no such gripper.
        """
        return self._commands.grasp(name)

    def release(self, name: str) -> int:
        """Let a gripper release all at the next advance; return how many particles it holds."""
        return self._commands.release(name)

    # State

    @property
    def scene(self) -> Scene:
        """Parameters of the cloth."""
        return self._simulation.scene

    @property
    def time(self) -> float:
        """Simulated time since the start or the last reset, s."""
        return self._simulation.time

    @property
    def positions(self) -> Array:
        """Positions, m, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return to_grid_copy(self._simulation.state.world_positions)

    @positions.setter
    def positions(self, value: Array) -> None:
        positions = self._simulation.state.grid.checked('positions', value)
        self._simulation.interactions.check('positions', positions)
        self._simulation.state.world_positions = positions
        self._simulation.accept_assigned_state(moved=True)

    @property
    def velocities(self) -> Array:
        """Velocities, m/s, shape (rows, columns, 3), a read-only copy; assign to set them."""
        return to_grid_copy(self._simulation.state.velocities)

    @velocities.setter
    def velocities(self, value: Array) -> None:
        state = self._simulation.state
        state.velocities = state.grid.checked('velocities', value)
        self._simulation.accept_assigned_state(moved=False)

    def write_particles(self, out: Array) -> None:
        """Write x y z vx vy vz of every particle, m and m/s, to `out`, (rows, columns, 6)."""
        state = self._simulation.state
        out[..., :3] = np.moveaxis(state.world_positions, 0, -1)
        out[..., 3:] = np.moveaxis(state.grid.interior(state.velocity), 0, -1)

    def write_positions(self, out: Array) -> None:
        """Write the position of every particle, m, to `out`, shape (rows, columns, 3)."""
        state = self._simulation.state
        out[...] = np.moveaxis(state.grid.interior(state.position), 0, -1)
        out += state.origin

    @property
    def colliders(self) -> Mapping[str, RigidCollider]:
        """Colliders of the scene by name, for reading; `move_collider` moves them."""
        return self._commands.colliders

    @property
    def self_contact(self) -> SelfContact | None:
        """Contact of the sheet with itself, for reading; None: the scene has none."""
        return self._simulation.interactions.self_contact

    def contact_wrench(self, name: str) -> tuple[Vector, Vector]:
        """
        Return the force, N, and the torque about its origin, N m, of the cloth on a collider.

        Both are means over the last advance, along the axes of the world.  Raises ValueError if
        there is no collider of this name.
        """
        return self._commands.collider(name).wrench(self.scene.sheet.cell_mass)

    @property
    def grippers(self) -> Mapping[str, Gripper]:
        """Grippers of the scene by name, for reading; `move_gripper` moves them."""
        return self._commands.grippers

    def gripper_wrench(self, name: str) -> tuple[Vector, Vector]:
        """Return the same of the cloth on a gripper: the weight of what it holds included."""
        return self._commands.gripper(name).wrench(self.scene.sheet.cell_mass)

    @property
    def sphere_position(self) -> Vector:
        """Centre of the sphere now, m; `sphere.position` of the scene if it has none."""
        return self.colliders.get('sphere', self.scene.sphere).position

    @property
    def sphere_radius(self) -> float:
        """Radius of the sphere now, m: one that was placed inside the sheet grows to its own."""
        sphere = self.colliders.get('sphere')
        return 0.0 if sphere is None else self.scene.sphere.radius - sphere.inset

    @property
    def sphere_depth(self) -> float:
        """Greatest depth of a triangle in the sphere at the last contact, m; 0 if tolerable."""
        return self.colliders['sphere'].max_penetration if 'sphere' in self.colliders else 0.0

    def contact_possible(self, seconds: float) -> bool:
        """Return False if no collider can reach the sheet within `seconds` of the next advance."""
        contact, state = self._simulation.interactions.contact, self._simulation.state
        return contact is not None and contact.contact_possible(state, seconds, self.inputs)

    # Energy and accuracy

    def energy(self) -> float:
        """Return kinetic, elastic and gravitational energy together, J."""
        return self.energy_by_kind().total

    def energy_by_kind(self) -> Energy:
        """Return the energy by kind, J; gravitational energy is zero at the world's origin."""
        state = self._simulation.state
        return energy(state.world_positions, state.velocities, self.scene)

    def strain(self) -> Strain:
        """Return the largest stretch, shear and folding of the sheet."""
        return strain(self._simulation.state.world_positions, self.scene.sheet.spacing)

    @property
    def work(self) -> float:
        """Most work, J, of air, colliders and grippers since the start: a bound of the energy."""
        return self._simulation.work

    @property
    def rollbacks(self) -> RollbackCounts:
        """Batches of substeps that were repeated since this cloth was made."""
        return self._rollbacks

    @property
    def substep(self) -> float:
        """Length of the substeps, s; a whole number of them makes a tick of the scene's rate."""
        return self._simulation.step_control.substep

    @property
    def substeps(self) -> int:
        """Number of substeps of the last advance, those of repeated batches included."""
        return self._simulation.substeps

    @property
    def stability_limit(self) -> float:
        """Longest stable substep, s, in every state of the cloth; inf without springs."""
        return stability_limit(self.scene)

    # Compilation

    def warm_up(self, kinds: Collection[str] = ('motion', 'contact')) -> Iterator[str]:
        """Compile those kinds of kernels that the scene needs; yield each kind before it."""
        if 'motion' in kinds:
            yield 'motion'
            self._simulation.warm_up()
        if 'contact' in kinds and self._simulation.interactions.contact is not None:
            yield 'contact'
            self._simulation.warm_up_contact()

    def time_substep(self) -> float:
        """Return the wall-clock time of a substep without contact, s; compiles if needed."""
        return self._simulation.time_substep()
