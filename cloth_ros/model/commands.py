"""Commands for the next advance of a cloth, each checked when it is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from ..scene.parameter import invalid_value_error
from .contact.rigid_collider import RigidCollider
from .grippers.gripper import Gripper
from .inputs import Inputs
from .kinematic_path import commanded_path
from .simulation import Simulation

T = TypeVar('T')


def _known(bodies: Mapping[str, T], kind: str, name: str) -> T:
    """Return a body; raises ValueError if there is none of this name."""
    if name in bodies:
        return bodies[name]
    raise invalid_value_error(kind, name, f'one of: {", ".join(bodies) or "none"}', 'choose one')


class Commands:
    """
    Commands to the colliders and grippers of a simulation.

    Parameters
    ----------
    simulation
        Has the colliders and grippers.
    inputs
        Commands so far; those to other colliders and grippers are left out.

    Attributes
    ----------
    inputs
        Of the next advance.

    All methods raise ValueError for a body that there is not, and for invalid values.

    """

    def __init__(self, simulation: Simulation, inputs: Inputs) -> None:
        self._simulation = simulation
        self.inputs = inputs.for_bodies(self.colliders, self.grippers)

    @property
    def colliders(self) -> Mapping[str, RigidCollider]:
        """The colliders by name."""
        contact = self._simulation.interactions.contact
        return {} if contact is None else contact.colliders

    @property
    def grippers(self) -> Mapping[str, Gripper]:
        """The grippers by name."""
        grippers = self._simulation.interactions.grippers
        return {} if grippers is None else grippers.by_name

    def collider(self, name: str) -> RigidCollider:
        """Return a collider."""
        return _known(self.colliders, 'collider', name)

    def gripper(self, name: str) -> Gripper:
        """Return a gripper."""
        return _known(self.grippers, 'gripper', name)

    def check(self, inputs: Inputs) -> None:
        """Check that there are the colliders and grippers of some inputs."""
        for name in inputs.collider_paths:
            self.collider(name)
        for name in (*inputs.gripper_paths, *(name for name, _ in inputs.grips)):
            self.gripper(name)

    def move_collider(
        self, name: str, position: Sequence[float], orientation: Sequence[float] | None
    ) -> None:
        """Add a waypoint, m and quaternion x y z w, to the path of a collider."""
        collider, path = self.collider(name), self.inputs.collider_paths.get(name, ())
        target, size = (position, orientation), collider.shape.bounding_radius
        origin = self._simulation.state.origin
        path = commanded_path(name, collider.pose, path, target, size, origin)
        self.inputs = self.inputs.with_path(name, path)

    def move_gripper(
        self, name: str, position: Sequence[float], orientation: Sequence[float] | None
    ) -> None:
        """Add a waypoint, m and quaternion x y z w, to the path of a gripper."""
        gripper, path = self.gripper(name), self.inputs.gripper_paths.get(name, ())
        target, origin = (position, orientation), self._simulation.state.origin
        path = commanded_path(name, gripper.pose, path, target, 0.0, origin)
        self.inputs = self.inputs.with_gripper_path(name, path)

    def grasp(self, name: str) -> int:
        """Close a gripper; return how many particles it will hold, at least one."""
        inputs = self.inputs.with_grip(name, True)
        held = self._held(name, inputs)
        self.inputs = inputs
        return held

    def release(self, name: str) -> int:
        """Open a gripper; return how many particles it releases."""
        held = self._held(name, self.inputs)
        self.inputs = self.inputs.with_grip(name, False)
        return held

    def _held(self, name: str, inputs: Inputs) -> int:
        """Return how many particles a gripper will hold after commands."""
        self.gripper(name)
        simulation = self._simulation
        assert simulation.interactions.grippers is not None
        return simulation.interactions.grippers.preview(name, inputs.grips, simulation.state)
