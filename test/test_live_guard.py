"""The guard of a running node, in a storm that is more than its steps can take."""

import math
import time

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
from ros import PATIENCE, numbers, wind
from sensor_msgs.msg import PointCloud2

STORM = 1e4  # m/s


def test_what_is_repeated_is_said_and_nothing_that_is_not_finite_is_published(start_cloth, probe):
    start_cloth(sheet__rows=32, sheet__columns=32, wind__air_density=1e3)
    particles = probe.collect(PointCloud2, '/cloth/particles', depth=500)
    reports = probe.collect(DiagnosticArray, '/diagnostics')
    blow = probe.publisher(Vector3Stamped, '/wind')
    probe.spin_until(lambda: particles and reports)
    said, end = [], time.monotonic() + PATIENCE
    while not said:
        assert time.monotonic() < end, 'waited in vain'
        for sign in (1.0, -1.0):
            blow.publish(wind(y=sign * STORM))
            probe.spin_for(0.3)
        status = [report.status[0] for report in reports]
        said = [each for each in status if 'unexplained energy' in each.message]
    assert said[0].level == DiagnosticStatus.WARN
    values = {each.key: each.value for each in said[0].values}
    assert int(values['substep batches refined']) > 0
    assert math.isfinite(float(values['energy [J]']))
    blow.publish(wind())
    seen = len(particles)
    probe.spin_until(lambda: len(particles) > seen + 30)
    assert all(np.isfinite(numbers(message)).all() for message in particles)
