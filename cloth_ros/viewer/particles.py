"""Decode the particles of a cloth from a PointCloud2."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

_FIELDS = ('x', 'y', 'z', 'vx', 'vy', 'vz')
MAX_PARTICLES = 2**20


class Sheet(NamedTuple):
    """
    State of a sheet at one time.

    Attributes
    ----------
    stamp
        Time of the state, s.
    frame_id
        Frame of the positions.
    positions, velocities
        Of the particles, m and m/s, shape (rows, columns, 3).

    """

    stamp: float
    frame_id: str
    positions: NDArray[np.float32]
    velocities: NDArray[np.float32]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns, _ = self.positions.shape
        return rows, columns


def decode(message: PointCloud2) -> Sheet:
    """
    Return the particles of a message.

    Raises
    ------
    ValueError
        The message is not that of a cloth, or contains a number that is not finite.

    """
    rows, columns = message.height, message.width
    offsets = {
        field.name: field.offset
        for field in message.fields
        if field.datatype == PointField.FLOAT32 and field.count == 1
    }
    missing = [name for name in _FIELDS if name not in offsets]
    if missing:
        raise ValueError(f'no FLOAT32 field {missing[0]!r}')
    if not 0 < rows * columns <= MAX_PARTICLES:
        raise ValueError(f'{rows} × {columns} particles, but must be 1 to {MAX_PARTICLES}')
    if message.row_step != columns * message.point_step:
        raise ValueError('row_step is not width × point_step')
    if len(message.data) != rows * message.row_step:
        raise ValueError(f'{len(message.data)} bytes, but must be {rows * message.row_step}')
    layout = np.dtype(
        {
            'names': _FIELDS,
            'formats': [('>' if message.is_bigendian else '<') + 'f4'] * len(_FIELDS),
            'offsets': [offsets[name] for name in _FIELDS],
            'itemsize': message.point_step,
        }
    )
    points = np.frombuffer(message.data, layout).reshape(rows, columns)
    numbers = np.empty((rows, columns, len(_FIELDS)), np.float32)
    for index, name in enumerate(_FIELDS):
        numbers[..., index] = points[name]
    if not np.isfinite(numbers).all():
        raise ValueError('a number that is not finite')
    stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    return Sheet(stamp, message.header.frame_id, numbers[..., :3], numbers[..., 3:])
