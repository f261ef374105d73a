"""Write a bag of the form in which a live cloth is recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin, Writer

from ..live.keyframe import Keyframe
from ..live.tick_record import TickRecord, scene_text
from ..scene import Scene
from .bag import TYPESTORE, Message
from .recorded_cloth import TYPES

_FLOAT32 = 7  # of sensor_msgs/PointField
_STATE = ('x', 'y', 'z', 'vx', 'vy', 'vz')
_ERROR = ('x', 'y', 'z', 'error')


class OutputBag:
    """
    A new bag with particles, records, keyframes and scenes of a cloth, and copies of the inputs.

    Parameters
    ----------
    path
        Folder to make.
    node
        Full name of the node of the cloth.
    frame_id
        Frame of the positions.
    received
        Returns the time at which messages are said to be received, ns; None: their stamps.

    Raises
    ------
    ValueError
        The folder exists already or cannot be made.

    """

    def __init__(
        self, path: Path, node: str, frame_id: str, received: Callable[[], int] | None = None
    ) -> None:
        if path.exists():
            raise ValueError(f'{path} exists already; give the name of a new folder')
        self._node, self._frame_id, self._received = node, frame_id, received
        try:
            self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.open()
        except OSError as error:
            raise ValueError(f'{path}: {error.strerror}; give a folder to write to') from None
        self._connections: dict[str, Any] = {}

    def close(self) -> None:
        """Complete the bag."""
        self._writer.close()

    def copy(self, message: Message) -> None:
        """Write a message of another bag; one of a type that is not known is left out."""
        if message.topic not in self._connections:
            try:
                self._connections[message.topic] = self._writer.add_connection(
                    message.topic, message.type, typestore=TYPESTORE
                )
            except Exception:  # a message of somebody else's package
                self._connections[message.topic] = None
        connection = self._connections[message.topic]
        if connection is not None:
            self._writer.write(connection, message.received, message.data)

    def _write(self, name: str, kind: str, stamp: int, message: object) -> None:
        data = bytes(TYPESTORE.serialize_cdr(message, kind))
        received = self._received() if self._received else stamp
        self.copy(Message(f'{self._node}/{name}', kind, received, data))

    def write_record(self, record: TickRecord) -> None:
        """Write the record of a tick."""
        text = TYPESTORE.types[TYPES['ticks']](data=record.encode())
        self._write('ticks', TYPES['ticks'], record.stamp, text)

    def write_scene(self, scene: Scene, stamp: int) -> None:
        """Write the scene as it runs from a time in ns on."""
        text = TYPESTORE.types[TYPES['scene']](data=scene_text(scene))
        self._write('scene', TYPES['scene'], stamp, text)

    def write_keyframe(self, keyframe: Keyframe) -> None:
        """Write a keyframe."""
        kind, types = TYPES['keyframes'], TYPESTORE.types
        layout = types['std_msgs/msg/MultiArrayLayout'](dim=[], data_offset=0)
        data = np.frombuffer(keyframe.encode(), np.uint8)
        self._write('keyframes', kind, keyframe.stamp, types[kind](layout=layout, data=data))

    def write_particles(self, stamp: int, values: NDArray[np.float32]) -> None:
        """Write x y z vx vy vz of every particle, or x y z alone, as a state stamped in ns."""
        names = _STATE[: values.shape[-1]]
        self._write('particles', TYPES['particles'], stamp, self._cloud(stamp, values, names))

    def write_errors(self, stamp: int, values: NDArray[np.float32]) -> None:
        """Write x y z of every particle and its error, m, shape (rows, columns, 4)."""
        self._write('error', TYPES['particles'], stamp, self._cloud(stamp, values, _ERROR))

    def _cloud(self, stamp: int, values: NDArray[np.float32], names: tuple[str, ...]) -> Any:
        types = TYPESTORE.types
        rows, columns, size = values.shape
        seconds, nanoseconds = divmod(stamp, 10**9)
        time = types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)
        make_field = types['sensor_msgs/msg/PointField']
        return types[TYPES['particles']](
            header=types['std_msgs/msg/Header'](stamp=time, frame_id=self._frame_id),
            height=rows,
            width=columns,
            fields=[
                make_field(name=name, offset=4 * index, datatype=_FLOAT32, count=1)
                for index, name in enumerate(names)
            ],
            is_bigendian=False,
            point_step=4 * size,
            row_step=4 * size * columns,
            data=np.ascontiguousarray(values, np.float32).view(np.uint8).reshape(-1),
            is_dense=True,
        )
