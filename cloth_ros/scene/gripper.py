"""
Parameters of grippers: they hold particles of the sheet, which then follow their pose rigidly.

See `named_group` for how they are named and prepared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .named_group import NamedGroup, NamedMember
from .parameter import parameter


@dataclass(frozen=True)
class GripperParameters(NamedMember):
    """
    Parameters of one gripper.

    Attributes
    ----------
    radius
        Distance from the origin of the gripper within which it takes particles, m.
    slip_force
        Pull of the sheet on the whole grip above which particles slip out, N; 0: none does.

    """

    group: ClassVar[str] = 'gripper.'
    written: ClassVar[str] = 'radius'
    radius: float = parameter(
        0.02, 'distance within which it takes particles', unit='m', low=1e-4, high=1e3
    )
    slip_force: float = parameter(
        0.0, 'pull above which particles slip out; 0: none does', unit='N', low=0, high=1e9
    )


@dataclass(frozen=True)
class Grippers(NamedGroup[GripperParameters]):
    """The grippers of a scene, and parameters of others that are not added yet."""

    prefix: ClassVar[str] = 'gripper.'
    member: ClassVar[type[NamedMember]] = GripperParameters
    names: tuple[str, ...] = parameter((), 'names of grippers')
