"""The topic `~/particles`: every particle, at each tick or at `particles.rate`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from sensor_msgs.msg import PointCloud2

from ...messages.particles import ParticlesMessage, coordinate_spacing
from ...scene.parameter import format_value
from ..context import Context
from ..publisher import TolerantPublisher
from .rate_limit import RateLimit


class ParticlesOutput:
    """Publish the particles; warn once if their coordinates are too coarse."""

    def __init__(self, context: Context) -> None:
        scene = context.live.scene
        self._live = context.live
        self._publisher = TolerantPublisher(context, PointCloud2, '~/particles')
        self._message = self._make_message()
        self._limit = RateLimit()
        self.topics = (self._publisher.topic,)
        self._log = context.node.get_logger()
        self._warned = False
        self._check_spacing(scene.sheet.position)

    def publish(self, now: float, stamp: int) -> None:
        """Publish the present state, stamped in ns, if it is time and there is a subscriber."""
        if self._due(now) and self._publisher.wanted:
            if self._message.velocities != self._live.scene.particles.velocities:
                self._message = self._make_message()
            times = divmod(stamp, 1_000_000_000)
            self._publisher.publish(self._message.serialise(self._live, *times))
            if not self._warned:
                self._check_spacing(self._message.first_position)

    def _due(self, now: float) -> bool:
        """Return whether particles are due at `now`, s."""
        scene = self._live.scene
        rate = scene.particles.rate
        return rate == 0 or self._limit.due(now, rate, scene.rate)

    def _make_message(self) -> ParticlesMessage:
        scene = self._live.scene
        sheet, velocities = scene.sheet, scene.particles.velocities
        return ParticlesMessage(sheet.rows, sheet.columns, scene.frame_id, velocities)

    def _check_spacing(self, position: ArrayLike) -> None:
        """Warn if single precision does not resolve positions as far from the origin as this."""
        scene = self._live.scene
        spacing, tolerance = coordinate_spacing(position), scene.solver.tolerance
        # No frame is near to all of a sheet that is itself too large.
        if spacing <= max(tolerance, coordinate_spacing(scene.sheet.size)):
            return
        self._warned = True
        x, y, z = np.asarray(position, float).tolist()
        self._log.warning(
            f'positions near ({x:g}, {y:g}, {z:g}) m are published in single precision, in steps '
            f'of {spacing:.3g} m, coarser than solver.tolerance ({tolerance:g} m); choose a '
            'frame_id nearer to the cloth, give sheet.position and sphere.position in that frame, '
            'and publish where it is: ros2 run tf2_ros static_transform_publisher '
            f'--x {x:g} --y {y:g} --z {z:g} --frame-id {format_value(scene.frame_id)} '
            '--child-frame-id FRAME_ID'
        )
