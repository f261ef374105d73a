"""Particles as a PointCloud2, in the layout of the sheet: positions, and velocities or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from .cdr import STAMP, SerializedMessage
from .published_cloth import PublishedCloth

FIELDS = ('x', 'y', 'z', 'vx', 'vy', 'vz')
# Of bytes that do not occur in UTF-8, so that the name of a frame cannot equal it.
_PLACEHOLDER = bytes(range(0xF8, 0x100)) * 3


def coordinate_spacing(position: ArrayLike) -> float:
    """Return the distance, m, between neighbouring values of the largest coordinate published."""
    return float(np.spacing(np.abs(np.asarray(position, np.float32)).max()))


class ParticlesMessage:
    """
    An organised PointCloud2: its height is the number of rows, its width that of columns.

    Parameters
    ----------
    rows, columns
        Particles of the sheet.
    frame_id
        Frame of the positions.
    velocities
        Whether velocities are published.

    Attributes
    ----------
    velocities
        The same.

    """

    def __init__(self, rows: int, columns: int, frame_id: str, velocities: bool = True) -> None:
        self.velocities = velocities
        names = FIELDS if velocities else FIELDS[:3]
        point_step = 4 * len(names)
        placeholder = _PLACEHOLDER[:point_step]
        message = PointCloud2(
            header=Header(stamp=STAMP, frame_id=frame_id),
            height=rows,
            width=columns,
            fields=[
                PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
                for i, name in enumerate(names)
            ],
            is_bigendian=False,
            point_step=point_step,
            row_step=point_step * columns,
            is_dense=True,
        )
        message.data.frombytes(placeholder)
        self._message = SerializedMessage(message)
        offset = self._message.repeat(placeholder, point_step, rows * columns)
        self._message.freeze()
        self._points = self._message.view(offset, np.float32, (rows, columns, len(names)))
        # Positions are rounded as in a message with velocities, to the same bits.
        shape = (rows, columns, len(FIELDS))
        self._values = self._points if velocities else np.empty(shape, np.float32)

    @property
    def first_position(self) -> NDArray[np.float32]:
        """Position of the first particle as it was serialised last, m, shape (3,)."""
        return self._points[0, 0, :3]

    def serialise(self, cloth: PublishedCloth, seconds: int, nanoseconds: int) -> bytes:
        """Return the serialised message of the present state of `cloth`, stamped."""
        self._message.stamp(seconds, nanoseconds)
        cloth.write_particles(self._values)
        if not self.velocities:
            self._points[...] = self._values[..., :3]
        return self._message.tobytes()
