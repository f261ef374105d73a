"""The state of the particles as a point cloud."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from ..model import Cloth
from .cdr import STAMP, SerializedMessage

FIELDS = ('x', 'y', 'z', 'vx', 'vy', 'vz')
_POINT_STEP = 4 * len(FIELDS)
# Of bytes that no UTF-8 has, so that no frame's name is taken for it.
_PLACEHOLDER = bytes(range(0xF8, 0x100)) * 3


class ParticlesMessage:
    """An organised PointCloud2: height is rows, width is columns."""

    def __init__(self, rows: int, columns: int, frame_id: str) -> None:
        message = PointCloud2(
            header=Header(stamp=STAMP, frame_id=frame_id),
            height=rows,
            width=columns,
            fields=[
                PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
                for i, name in enumerate(FIELDS)
            ],
            is_bigendian=False,
            point_step=_POINT_STEP,
            row_step=_POINT_STEP * columns,
            is_dense=True,
        )
        message.data.frombytes(_PLACEHOLDER)
        self._template = SerializedMessage(message)
        place = self._template.stretch(_PLACEHOLDER, _POINT_STEP, rows * columns)
        self._template.freeze()
        self._points = self._template.view(place, np.float32, (rows, columns, len(FIELDS)))

    def serialise(self, cloth: Cloth, seconds: int, nanoseconds: int) -> bytes:
        """Return the message for the present state of `cloth`, stamped."""
        self._template.stamp(seconds, nanoseconds)
        cloth.write_particles(self._points)
        return self._template.tobytes()
