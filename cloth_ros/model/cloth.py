"""Public interface of the model: read the state, set the inputs, advance."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..scene import Scene
from ..scene.parameter import checked_number, invalid_value_error
from ..scene.quaternion import checked_orientation
from . import snapshot_file
from .contact.kinematic_path import checked_position, extend_path
from .contact.rigid_collider import RigidCollider
from .energy import Energy, energy
from .energy_monitor import EnergyMonitor, RollbackCounts
from .grid import Array, to_grid_copy
from .inputs import Inputs, Vector, inputs_for
from .scene_check import check_change, check_scene
from .self_contact.self_contact import SelfContact
from .simulation import MAX_SECONDS, Simulation
from .snapshot import Snapshot
from .step_control import AdaptiveStepControl, StepControl
from .strain import Strain, strain
from .substep_observer import SubstepObserver
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
        observer: SubstepObserver | None = None,
        rollbacks: RollbackCounts | None = None,
    ) -> None:
        check_scene(scene)
        self._step_control, self._observer = step_control, observer
        self._energy_monitor = energy_monitor
        self._rollbacks = RollbackCounts() if rollbacks is None else rollbacks
        self._inputs = Inputs(scene.wind.velocity)
        self._simulation = self._simulation_of(scene)
        self._simulation.start()

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
            Wind, which then holds, and paths of colliders; None: the commands given before.

        Raises
        ------
        ValueError
            `seconds` is negative, not finite, or more than a million; or `inputs` has the path
            of a collider that there is not.

        """
        for _ in self.advance_stepwise(seconds, inputs):
            pass

    def advance_stepwise(self, seconds: float, inputs: Inputs | None = None) -> Iterator[None]:
        """
        Advance as `advance` does, but pause after each batch of substeps.

        Until the iteration is over or closed, positions and velocities do not belong to one time.
        Closed half-way, the cloth is left at the last accepted batch.
        """
        if inputs is None:
            inputs = self._inputs
        for name in inputs.collider_paths:
            self._collider(name)
        seconds = checked_number('seconds', seconds, 0.0, MAX_SECONDS, 's')
        steps = self._simulation.advance_stepwise(seconds, inputs)
        return self._take_inputs(steps, self.time + seconds > self.time, inputs)

    def _take_inputs(self, steps: Iterator[None], moves: bool, inputs: Inputs) -> Iterator[None]:
        if moves and (inputs.collider_paths or inputs is not self._inputs):
            # Not in an advance of zero: its waypoints are for the next one.
            self._inputs = Inputs(inputs.wind)
        yield from steps

    def reset(self) -> None:
        """Return to the initial state: sheet, wind, colliders and time."""
        self._simulation = self._simulation_of(self.scene)
        self._simulation.start()
        self._inputs = Inputs(self.scene.wind.velocity)

    def configure(self, scene: Scene) -> None:
        """
        Continue from the present state with the parameters of another scene.

        A collider whose position parameter has changed moves there in the next advance.

        Raises
        ------
        ValueError
            A fixed parameter differs, or the scene cannot be simulated.

        """
        check_change(self.scene, scene)
        inputs = inputs_for(self._inputs, self.scene, scene)
        simulation = self._simulation_of(scene)
        simulation.restore(self.snapshot())
        simulation.substeps = self.substeps
        self._simulation, self._inputs = simulation, inputs

    def snapshot(self) -> Snapshot:
        """Return an immutable copy of everything that later results depend on."""
        return self._simulation.snapshot(self._inputs)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot; that of another scene is converted in precision and grid."""
        self._simulation.restore(snapshot)
        paths = snapshot.inputs.collider_paths
        present = {name: paths[name] for name in self.colliders if name in paths}
        self._inputs = replace(snapshot.inputs, collider_paths=present)

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
        """Commands for the next advance: the wind, and the waypoints of colliders."""
        return self._inputs

    @property
    def wind(self) -> Vector:
        """Commanded velocity of the air, m/s; gusts are added to it.  Assign to command it."""
        return self._inputs.wind

    @wind.setter
    def wind(self, velocity: Sequence[float]) -> None:
        self._inputs = self._inputs.with_wind(velocity)

    @property
    def air_velocity(self) -> Vector:
        """Velocity of the air now, gusts included, m/s."""
        return self._simulation.air_velocity(self._inputs.wind)

    def move_collider(
        self,
        name: str,
        position: Sequence[float],
        orientation: Sequence[float] | None = None,
    ) -> None:
        """
        Move a collider to a pose, which it reaches at the end of the next advance.

        Poses given one after the other before that are passed in their order; of more than 64,
        the last one and others that are spread evenly along the path.

        Parameters
        ----------
        name
            Of the collider.
        position
            Of its origin, m.
        orientation
            Quaternion x y z w of any length but 0; None: it does not turn.

        Raises
        ------
        ValueError
            The pose is not finite or too far away, or there is no such collider.

        """
        collider, origin = self._collider(name), self._simulation.state.origin
        path = self._inputs.collider_paths.get(name, ())
        target = checked_position(name, position, collider.shape.bounding_radius, origin)
        turned = (path[-1] if path else collider.pose)[3:]
        if orientation is not None:
            turned = checked_orientation(f'the orientation of {name}', orientation)
        path = extend_path(collider.pose, path, (*target, *turned))
        self._inputs = self._inputs.with_path(name, path)

    def _collider(self, name: str) -> RigidCollider:
        """Return a collider; raises ValueError if there is none of this name."""
        if name in self.colliders:
            return self.colliders[name]
        known = ', '.join(self.colliders) or 'none'
        raise invalid_value_error('collider', name, f'one of: {known}', 'choose one')

    def move_sphere(self, position: Sequence[float]) -> None:
        """Move the sphere; see `move_collider`."""
        if 'sphere' not in self.colliders:
            allowed, remedy = 'more than 0 to move a sphere', 'set it to its radius'
            raise invalid_value_error('sphere.radius', 0.0, allowed, remedy)
        self.move_collider('sphere', position)

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
        state = self._simulation.state
        positions = state.grid.checked('positions', value)
        if self.self_contact is not None:
            self.self_contact.check('positions', positions)
        state.world_positions = positions
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
        contact = self._simulation.contact
        return {} if contact is None else contact.colliders

    @property
    def self_contact(self) -> SelfContact | None:
        """Contact of the sheet with itself, for reading; None: the scene has none."""
        return self._simulation.self_contact

    def contact_wrench(self, name: str) -> tuple[Vector, Vector]:
        """Return force, N, and torque, N m, on a collider; means over the last advance."""
        return self._collider(name).wrench(self.scene.sheet.cell_mass)

    @property
    def sphere_position(self) -> Vector:
        """Centre of the sphere now, m; `sphere.position` of the scene if it has none."""
        known = 'sphere' in self.colliders
        return self.colliders['sphere'].position if known else self.scene.sphere.position

    @property
    def sphere_radius(self) -> float:
        """Radius of the sphere now, m: one that was placed inside the sheet grows to its own."""
        known = 'sphere' in self.colliders
        return self.scene.sphere.radius - self.colliders['sphere'].inset if known else 0.0

    @property
    def sphere_depth(self) -> float:
        """Greatest depth of a triangle in the sphere at the last contact, m; 0 if tolerable."""
        return self.colliders['sphere'].max_penetration if 'sphere' in self.colliders else 0.0

    def contact_possible(self, seconds: float) -> bool:
        """Return False if no collider can reach the sheet within `seconds` of the next advance."""
        contact, state = self._simulation.contact, self._simulation.state
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
        """Most work, J, of air and colliders since the start or reset: a bound of the energy."""
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
        if 'contact' in kinds and self._simulation.contact is not None:
            yield 'contact'
            self._simulation.warm_up_contact()

    def time_substep(self) -> float:
        """Return the wall-clock time of a substep without contact, s; compiles if needed."""
        return self._simulation.time_substep()
