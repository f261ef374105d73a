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


def decode(message: PointCloud2, former: Sheet | None = None) -> Sheet:
    """
    Return the particles of a message.

    Parameters
    ----------
    message
        With the fields x y z vx vy vz and possibly others, or with x y z alone.
    former
        Sheet of the message before, from which velocities are computed where there are none; zero
        without it.

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
    # Not any cloud that has no velocities: those of cameras have colours or intensities.
    names = _FIELDS[:3] if {field.name for field in message.fields} == {'x', 'y', 'z'} else _FIELDS
    missing = [name for name in names if name not in offsets]
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
            'names': names,
            'formats': [('>' if message.is_bigendian else '<') + 'f4'] * len(names),
            'offsets': [offsets[name] for name in names],
            'itemsize': message.point_step,
        }
    )
    points = np.frombuffer(message.data, layout).reshape(rows, columns)
    numbers = np.empty((rows, columns, len(names)), np.float32)
    for index, name in enumerate(names):
        numbers[..., index] = points[name]
    if not np.isfinite(numbers).all():
        raise ValueError('a number that is not finite')
    stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    positions = numbers[..., :3]
    velocities = numbers[..., 3:] if len(names) > 3 else _difference(positions, stamp, former)
    return Sheet(stamp, message.header.frame_id, positions, velocities)


def _difference(
    positions: NDArray[np.float32], stamp: float, former: Sheet | None
) -> NDArray[np.float32]:
    """Return the mean velocities since another state, m/s."""
    if former is None or former.positions.shape != positions.shape or former.stamp > stamp:
        return np.zeros_like(positions)
    if former.stamp == stamp:  # the cloth is paused
        return former.velocities
    return (positions - former.positions) / np.float32(stamp - former.stamp)
