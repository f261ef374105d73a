"""
Records of ticks: what acted on the cloth in each, so that it can be repeated to the bit.

A tick takes its inputs in a fixed order: first changes, each as the node handled it (parameters, a
reset, a restored state); then one advance, with the wind, the paths of colliders and grippers,
and the grasps that were commanded before the tick began.  A record is JSON: numbers are written
such that reading returns the same bits.
"""

from __future__ import annotations

import functools
import importlib.metadata
from typing import Any, Literal

import msgspec

from ..model.inputs import Inputs, Pose, Vector
from ..scene import Scene
from ..scene.parameter_file import text_of

# Of the records, keyframes and scenes that are published; raised when their meaning changes.
FORMAT = 2

_NO_INPUTS = Inputs()

CONFIGURED: Literal['configured'] = 'configured'
RESET: Literal['reset'] = 'reset'
RESTORED: Literal['restored'] = 'restored'


class Change(msgspec.Struct, frozen=True, omit_defaults=True):
    """
    A change of a cloth between two advances.

    Attributes
    ----------
    kind
        `configured`: the parameters changed; `reset`: the cloth is in its initial state again;
        `restored`: in another state, which the keyframe of the same tick holds.
    parameters
        All of the new scene, by dotted name.
    spacing
        Of the grid that is simulated, as a multiple of the scene's own.

    """

    kind: Literal['configured', 'reset', 'restored']
    parameters: dict[str, Any] = {}
    spacing: int = 1

    @property
    def scene(self) -> Scene:
        """The new scene; raises ValueError if it is not valid."""
        return Scene.from_parameters(self.parameters)


class TickRecord(msgspec.Struct, frozen=True, omit_defaults=True):
    """
    What acted on a cloth in one tick, and the step that it made.

    Attributes
    ----------
    tick
        Number of the tick, one more than that of the tick before.
    stamp
        Time of the state after the tick, ns, as in the header of the particles.
    clock
        Time of the tick, ns, by the clock that ticks follow: a steady one, or with `use_sim_time`
        /clock.  Inputs that were handled before it are taken in.
    time
        Simulated time after the tick, s.
    changes
        Before the advance, in their order.
    seconds
        Length of the advance, s; 0: the cloth did not move.
    substep
        Length of its substeps in slow motion, s.
    wind
        Commanded velocity of the air, m/s.
    colliders
        Waypoints of colliders, x y z in m and a quaternion x y z w; see `Inputs.collider_paths`.
    grippers, grips
        The same of grippers, and grasps and releases; see `Inputs.grips`.

    """

    tick: int
    stamp: int
    clock: int
    time: float
    changes: tuple[Change, ...] = ()
    seconds: float = 0.0
    substep: float = 0.0
    wind: Vector = (0.0, 0.0, 0.0)
    colliders: dict[str, tuple[Pose, ...]] = {}
    grippers: dict[str, tuple[Pose, ...]] = {}
    grips: tuple[tuple[str, bool], ...] = ()

    @property
    def inputs(self) -> Inputs:
        """Inputs of the advance; raises ValueError if they are not valid."""
        return Inputs(self.wind, self.colliders, self.grippers, self.grips)

    def encode(self) -> str:
        """Return the record as JSON."""
        return msgspec.json.encode(self).decode()


def decode_record(text: str) -> TickRecord:
    """
    Return a record from JSON.

    Raises
    ------
    ValueError
        The text is not a record.

    """
    return msgspec.json.decode(text, type=TickRecord)


@functools.cache
def _versions() -> str:
    def version(name: str) -> str:
        try:
            return importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:  # a source tree that is not installed
            return 'unknown'

    names = ('cloth_ros', 'numba', 'llvmlite', 'numpy')
    return ', '.join(f'{name} {version(name)}' for name in names)


def scene_text(scene: Scene) -> str:
    """Return a scene as a ROS parameter file, with the versions that run it as a comment."""
    tree: dict[str, Any] = {}
    for name, value in scene.flat().items():
        *groups, last = name.split('.')
        place = tree
        for group in groups:
            place = place.setdefault(group, {})
        place[last] = [''] if value == () else value  # ROS cannot tell the type of an empty list
    return f'# {_versions()}; form {FORMAT}\n{text_of(tree)}'


class TickRecorder:
    """Collect what acts on a cloth until `take` returns it as a record."""

    def __init__(self) -> None:
        self._tick = 0
        self._clear()

    def _clear(self) -> None:
        self._changes: list[Change] = []
        self._inputs, self._seconds, self._substep = _NO_INPUTS, 0.0, 0.0

    @property
    def changed(self) -> bool:
        """True if there are changes that no record has yet."""
        return bool(self._changes)

    def configured(self, scene: Scene, spacing: int) -> None:
        """Record that another scene is simulated, on a grid `spacing` times as coarse."""
        self._changes.append(Change(CONFIGURED, scene.flat(), spacing))

    def reset(self) -> None:
        """Record that the cloth is in its initial state again."""
        self._changes.append(Change(RESET))

    def restored(self) -> None:
        """Record that the cloth is in another state."""
        self._changes.append(Change(RESTORED))

    def advanced(self, inputs: Inputs, seconds: float, substep: float) -> None:
        """Record the advance of the tick, s."""
        self._inputs, self._seconds, self._substep = inputs, seconds, substep

    def take(self, stamp: int, clock: int, time: float) -> TickRecord:
        """
        Return the record of the tick that has ended, and begin the next one.

        Parameters
        ----------
        stamp, clock
            Time of the state, and of the tick, ns.
        time
            Simulated time, s.

        """
        self._tick += 1
        record = TickRecord(
            tick=self._tick,
            stamp=stamp,
            clock=clock,
            time=time,
            changes=tuple(self._changes),
            seconds=self._seconds,
            substep=self._substep,
            wind=self._inputs.wind,
            colliders=dict(self._inputs.collider_paths),
            grippers=dict(self._inputs.gripper_paths),
            grips=self._inputs.grips,
        )
        self._clear()
        return record
