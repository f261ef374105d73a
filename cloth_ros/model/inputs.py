"""External inputs of one advance: wind and the paths of colliders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..scene import Scene
from ..scene.parameter import checked_vector, invalid_value_error
from ..scene.quaternion import IDENTITY, checked_orientation

Vector = tuple[float, float, float]
# x y z, m, and a unit quaternion x y z w.
Pose = tuple[float, float, float, float, float, float, float]


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

    Raises
    ------
    ValueError
        A number is not finite or out of range, or the form is not as above.

    """

    wind: Vector = (0.0, 0.0, 0.0)
    collider_paths: Mapping[str, tuple[Pose, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check and copy the values."""
        paths = self.collider_paths
        if not isinstance(paths, Mapping):
            raise invalid_value_error(
                'collider_paths',
                paths,
                'a mapping of names to waypoints',
                "write {'sphere': [[0.0, 0.0, 1.0]]}",
            )
        checked = {name: _path(f'waypoint of {name}', path) for name, path in paths.items()}
        object.__setattr__(self, 'wind', _vector('wind', self.wind, 'wind.velocity'))
        object.__setattr__(self, 'collider_paths', checked)

    def with_wind(self, velocity: Sequence[float]) -> Inputs:
        """Return the inputs with another wind, m/s, which alone is checked."""
        return self._trusted(_vector('wind', velocity, 'wind.velocity'), self.collider_paths)

    def with_path(self, name: str, path: tuple[Pose, ...]) -> Inputs:
        """Return the inputs with another path of a collider, whose waypoints are valid."""
        return self._trusted(self.wind, {**self.collider_paths, name: path})

    @staticmethod
    def _trusted(wind: Vector, paths: Mapping[str, tuple[Pose, ...]]) -> Inputs:
        # Not to check 64 waypoints again at each of some thousand commands per second.
        inputs = object.__new__(Inputs)
        object.__setattr__(inputs, 'wind', wind)
        object.__setattr__(inputs, 'collider_paths', paths)
        return inputs


def inputs_for(inputs: Inputs, before: Scene, after: Scene) -> Inputs:
    """
    Return the commands that hold after a change of the scene.

    The wind of the scene is one, if it has changed, and so is the pose of a collider.
    """
    wind, paths = inputs.wind, dict[str, tuple[Pose, ...]]()
    if after.wind.velocity != before.wind.velocity:
        wind = after.wind.velocity
    former = {each.name: (*each.position, *each.orientation) for each in before.all_colliders()}
    for each in after.all_colliders():
        name, pose = each.name, (*each.position, *each.orientation)
        if former.get(name, pose) != pose:
            paths[name] = (pose,)
        elif name in inputs.collider_paths:
            paths[name] = inputs.collider_paths[name]
    return Inputs(wind, paths)


def _vector(name: str, value: Any, parameter: str) -> Vector:
    x, y, z = checked_vector(name, value, parameter).tolist()
    return (x, y, z)


def _path(name: str, path: object) -> tuple[Pose, ...]:
    if not isinstance(path, (list, tuple)):
        raise invalid_value_error(name, path, 'a list of positions', 'write [[0.0, 0.0, 1.0]]')
    return tuple(_pose(name, point) for point in path)


def _pose(name: str, pose: Any) -> Pose:
    turned = isinstance(pose, (list, tuple)) and len(pose) == 7
    x, y, z = _vector(name, pose[:3] if turned else pose, 'sphere.position')
    if not turned:
        return (x, y, z, *IDENTITY)
    return (x, y, z, *checked_orientation(f'the orientation of {name}', pose[3:]))
