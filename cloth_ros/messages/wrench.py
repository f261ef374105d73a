"""Force and torque on a collider as a WrenchStamped."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Vector3, WrenchStamped
from std_msgs.msg import Header

from .cdr import STAMP, SerializedMessage, sentinel


class WrenchMessage:
    """
    A WrenchStamped.

    Parameters
    ----------
    frame_id
        Frame whose axes force and torque have.

    """

    def __init__(self, frame_id: str) -> None:
        message = WrenchStamped(header=Header(stamp=STAMP, frame_id=frame_id))
        numbers = sentinel(0, 6)
        message.wrench.force = Vector3(x=numbers[0], y=numbers[1], z=numbers[2])
        message.wrench.torque = Vector3(x=numbers[3], y=numbers[4], z=numbers[5])
        self._message = SerializedMessage(message)
        offset = self._message.find(np.array(numbers).tobytes())
        self._message.freeze()
        self._numbers = self._message.view(offset, np.float64, (2, 3))

    def serialise(
        self, force: Sequence[float], torque: Sequence[float], seconds: int, nanoseconds: int
    ) -> bytes:
        """Return the serialised message of a force, N, and a torque, N m, stamped."""
        self._message.stamp(seconds, nanoseconds)
        self._numbers[:] = force, torque
        return self._message.tobytes()
