"""Keyframe: the exact state of a running cloth after a tick, from which a replay can begin."""

from __future__ import annotations

from typing import Any

import msgspec

from ..model import Cloth
from ..model.snapshot import Snapshot
from ..model.snapshot_file import decode as decode_snapshot
from ..model.snapshot_file import encode as encode_snapshot
from ..scene import Scene
from .tick_record import FORMAT

INTERVAL = 10.0  # s of ticks, from one keyframe to the next


class Keyframe(msgspec.Struct, frozen=True):
    """
    State of a cloth after a tick.

    Attributes
    ----------
    format
        Version of this form.
    tick, stamp
        Number of the tick, and time of the state, ns, as in the record of the tick.
    parameters
        All of the scene that is published, by dotted name.
    spacing
        Of the grid that is simulated, as a multiple of the scene's own.
    data
        The snapshot, in the form in which it is saved to a file.

    """

    format: int
    tick: int
    stamp: int
    parameters: dict[str, Any]
    spacing: int
    data: bytes

    @property
    def scene(self) -> Scene:
        """The scene that is published; raises ValueError if it is not valid."""
        return Scene.from_parameters(self.parameters)

    @property
    def snapshot(self) -> Snapshot:
        """The state; raises ValueError if it is damaged."""
        return decode_snapshot(self.data)

    def encode(self) -> bytes:
        """Return the keyframe as bytes (MessagePack)."""
        return msgspec.msgpack.encode(self)


def keyframe_of(cloth: Cloth, scene: Scene, spacing: int, tick: int, stamp: int) -> Keyframe:
    """
    Return the keyframe of the present state of a cloth.

    Parameters
    ----------
    cloth
        As it is simulated.
    scene, spacing
        The scene that is published, and the spacing of the simulated grid as a multiple of its.
    tick, stamp
        Number of the tick that has ended, and time of the state, ns.

    """
    data = encode_snapshot(cloth.snapshot())
    return Keyframe(FORMAT, tick, stamp, scene.flat(), spacing, data)


def decode_keyframe(data: bytes) -> Keyframe:
    """
    Return a keyframe from its bytes; the snapshot within is checked when it is read.

    Raises
    ------
    ValueError
        The bytes are no keyframe, or one of a newer form.

    """
    keyframe = msgspec.msgpack.decode(data, type=Keyframe)
    if keyframe.format > FORMAT:
        raise ValueError(
            f'the recording has the form {keyframe.format}, and this version of cloth_ros reads '
            f'up to {FORMAT}; use a newer version'
        )
    return keyframe
