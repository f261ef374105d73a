"""External inputs of one advance: wind, paths of colliders and grippers, and grasps."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from ..scene import Scene
from ..scene.named_group import NamedMember
from ..scene.parameter import checked_vector, invalid_value_error
from ..scene.quaternion import IDENTITY, checked_orientation

Vector = tuple[float, float, float]
# Commands to grasp or release that are kept for one advance; more are an error.
_MAX_GRIPS = 256
# x y z, m, and a unit quaternion x y z w.
Pose = tuple[float, float, float, float, float, float, float]
Path = tuple[Pose, ...]


@dataclass(frozen=True, slots=True)
class Inputs:
    """
    Everything external that acts on a cloth during one advance.

    An advance is a function of a `Snapshot`, of these inputs and of its duration.

    Attributes
    ----------
    wind
        Commanded velocity of the air, m/s; gusts of the scene are added to it.
    collider_paths
        Waypoints, x y z in m and a quaternion x y z w, that a collider passes in this advance at
        constant speed, by the collider's name.  The last one is reached at the end; a collider
        without waypoints stands still.  Waypoints of three numbers mean no rotation.
    gripper_paths
        The same of grippers.
    grips
        Names of grippers, each with True to grasp what is within its radius, besides what it
        holds, or with False to release all; in this order at the start of the advance.

    Raises
    ------
    ValueError
        A number is not finite or out of range, or the form is not as above.

    """

    wind: Vector = (0.0, 0.0, 0.0)
    collider_paths: Mapping[str, Path] = field(default_factory=dict)
    gripper_paths: Mapping[str, Path] = field(default_factory=dict)
    grips: tuple[tuple[str, bool], ...] = ()

    def __post_init__(self) -> None:
        """Check and copy the values."""
        object.__setattr__(self, 'wind', _vector('wind', self.wind, 'wind.velocity'))
        for name, example in (('collider_paths', 'sphere'), ('gripper_paths', 'left')):
            object.__setattr__(self, name, _paths(name, getattr(self, name), example))
        object.__setattr__(self, 'grips', _grips(self.grips))

    @property
    def are_events(self) -> bool:
        """True if there is more than what holds until it is changed, as the wind does."""
        return bool(self.collider_paths or self.gripper_paths or self.grips)

    def with_wind(self, velocity: Sequence[float]) -> Inputs:
        """Return the inputs with another wind, m/s, which alone is checked."""
        return self._trusted(wind=_vector('wind', velocity, 'wind.velocity'))

    def with_path(self, name: str, path: Path) -> Inputs:
        """Return the inputs with another path of a collider, whose waypoints are valid."""
        return self._trusted(collider_paths={**self.collider_paths, name: path})

    def with_gripper_path(self, name: str, path: Path) -> Inputs:
        """Return the inputs with another path of a gripper, whose waypoints are valid."""
        return self._trusted(gripper_paths={**self.gripper_paths, name: path})

    def with_grip(self, name: str, closes: bool) -> Inputs:
        """Return the inputs with another command to grasp or release at their end; ValueError."""
        before = self.grips
        if before and before[-1][0] == name:  # which this one replaces
            before = before[:-1]
        return self._trusted(grips=_grips((*before, (name, closes))))

    def for_bodies(self, colliders: Container[str], grippers: Container[str]) -> Inputs:
        """Return the inputs without commands to other colliders and grippers than these."""
        return self._trusted(
            collider_paths=_of(self.collider_paths, colliders),
            gripper_paths=_of(self.gripper_paths, grippers),
            grips=tuple(each for each in self.grips if each[0] in grippers),
        )

    def _trusted(self, **changes: Any) -> Inputs:
        # Not to check 64 waypoints again at each of some thousand commands per second.
        inputs = object.__new__(Inputs)
        for each in fields(self):
            value = changes[each.name] if each.name in changes else getattr(self, each.name)
            object.__setattr__(inputs, each.name, value)
        return inputs


def _of(paths: Mapping[str, Path], names: Container[str]) -> dict[str, Path]:
    return {name: path for name, path in paths.items() if name in names}


def inputs_for(inputs: Inputs, before: Scene, after: Scene) -> Inputs:
    """
    Return the commands that hold after a change of the scene.

    The wind of the scene is one, if it has changed, and so is the pose of a collider or a gripper.
    """
    wind = inputs.wind
    if after.wind.velocity != before.wind.velocity:
        wind = after.wind.velocity
    names = [each.name for each in after.grippers]
    return Inputs(
        wind,
        _paths_for(inputs.collider_paths, before.all_colliders(), after.all_colliders()),
        _paths_for(inputs.gripper_paths, before.grippers, after.grippers),
        tuple(each for each in inputs.grips if each[0] in names),
    )


def _paths_for(
    paths: Mapping[str, Path],
    before: Sequence[NamedMember],
    after: Sequence[NamedMember],
) -> dict[str, Path]:
    result, former = dict[str, Path](), {each.name: each.pose for each in before}
    for each in after:
        if former.get(each.name, each.pose) != each.pose:
            result[each.name] = (each.pose,)
        elif each.name in paths:
            result[each.name] = paths[each.name]
    return result


def _vector(name: str, value: Any, parameter: str) -> Vector:
    x, y, z = checked_vector(name, value, parameter).tolist()
    return (x, y, z)


def _paths(name: str, paths: object, example: str) -> dict[str, Path]:
    if not isinstance(paths, Mapping):
        remedy = f'write {{{example!r}: [[0.0, 0.0, 1.0]]}}'
        raise invalid_value_error(name, paths, 'a mapping of names to waypoints', remedy)
    return {each: _path(f'waypoint of {each}', path) for each, path in paths.items()}


def _grips(grips: Any) -> tuple[tuple[str, bool], ...]:
    """Return commands to grasp and release, checked."""
    remedy = "write [('left', True)]"
    if not isinstance(grips, (list, tuple)):
        raise invalid_value_error('grips', grips, 'a list of names with True or False', remedy)
    if len(grips) > _MAX_GRIPS:
        raise invalid_value_error(
            'the number of grasps and releases in one advance',
            len(grips),
            f'at most {_MAX_GRIPS}',
            'wait for the next advance',
        )
    for each in grips:
        pair = isinstance(each, (list, tuple)) and len(each) == 2
        if not (pair and isinstance(each[0], str) and isinstance(each[1], bool)):
            raise invalid_value_error('grips', each, 'a name with True or False', remedy)
    return tuple((name, closes) for name, closes in grips)


def _path(name: str, path: object) -> Path:
    if not isinstance(path, (list, tuple)):
        raise invalid_value_error(name, path, 'a list of positions', 'write [[0.0, 0.0, 1.0]]')
    return tuple(_pose(name, point) for point in path)


def _pose(name: str, pose: Any) -> Pose:
    turned = isinstance(pose, (list, tuple)) and len(pose) == 7
    x, y, z = _vector(name, pose[:3] if turned else pose, 'sphere.position')
    if not turned:
        return (x, y, z, *IDENTITY)
    return (x, y, z, *checked_orientation(f'the orientation of {name}', pose[3:]))
