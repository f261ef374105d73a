"""Commands to the colliders and grippers of a running cloth, by their names."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..model import Cloth
from ..scene.quaternion import Quaternion
from .reconfiguration import Reconfiguration

Vector = tuple[float, float, float]


class BodyCommands:
    """
    Command colliders and grippers, and read the forces on them.

    Every method raises ValueError for a name that there is not; also for one that has been
    requested, as long as its kernels are being compiled.

    Parameters
    ----------
    cloth
        Returns the cloth that is simulated.
    prepare
        Makes changes of parameters that are due: they hold for commands that come after them.
    changes
        Knows what is requested.

    """

    def __init__(
        self, cloth: Callable[[], Cloth], prepare: Callable[[], None], changes: Reconfiguration
    ) -> None:
        self._now, self._prepare, self._changes = cloth, prepare, changes

    def _cloth_with(self, name: str) -> Cloth:
        """Return the cloth, which has a body of this name or refuses it with its own error."""
        self._prepare()
        cloth = self._now()
        if name not in cloth.colliders and name not in cloth.grippers:
            self._changes.check_no_request_of(name)
        return cloth

    def move(
        self, name: str, position: Sequence[float], orientation: Sequence[float] | None = None
    ) -> None:
        """
        Move a collider or a gripper to a pose, m and quaternion x y z w, by the end of a tick.

        Without an orientation it keeps its own.  Raises ValueError for a pose that is not finite,
        a quaternion of zero length, or a position too far away.
        """
        cloth = self._cloth_with(name)
        if name in cloth.grippers:
            cloth.move_gripper(name, position, orientation)
        elif name == 'sphere' and name not in cloth.colliders:
            cloth.move_sphere(position)  # the error names its parameter
        else:
            cloth.move_collider(name, position, orientation)

    def grasp(self, name: str) -> int:
        """Close a gripper; return how many particles it will hold; see `Cloth.grasp`."""
        return self._cloth_with(name).grasp(name)

    def release(self, name: str) -> int:
        """Open a gripper; return how many particles it holds; see `Cloth.release`."""
        return self._cloth_with(name).release(name)

    def pose(self, name: str) -> tuple[Vector, Quaternion] | None:
        """Return where a body is, m and quaternion x y z w; None: it is not there."""
        cloth = self._now()
        if name in cloth.grippers:
            return cloth.grippers[name].position, cloth.grippers[name].orientation
        collider = cloth.colliders.get(name)
        return None if collider is None else (collider.position, collider.orientation)

    def wrench(self, name: str) -> tuple[Vector, Vector]:
        """Return force, N, and torque, N m, of the cloth on a body in the last tick."""
        cloth = self._now()
        if name in cloth.grippers:
            return cloth.gripper_wrench(name)
        return cloth.contact_wrench(name)
