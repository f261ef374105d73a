"""The program that folds a towel, against a running node."""

import sys
import time

import numpy as np
import pytest
from ros import PATIENCE, ROOT, numbers
from sensor_msgs.msg import PointCloud2

FOLDER = (sys.executable, str(ROOT / 'examples' / 'fold_towel.py'))


@pytest.mark.slow
def test_the_towel_is_folded_in_half_twice(start_cloth, start, probe):
    """It ends on a quarter of its area; every corner is on the same quarter of the table."""
    node = start_cloth('--params-file', str(ROOT / 'config' / 'towel.yaml'))
    states = probe.collect(PointCloud2, '/cloth/particles', 5)
    program = start(*FOLDER)
    end = time.monotonic() + PATIENCE
    while program.alive:
        assert time.monotonic() < end, program.output
        probe.spin_for(0.2)
        del states[:-1]
    assert program.stop(0) == 0, program.output
    taken = [int(line.split()[2]) for line in program.output.splitlines() if ' holds ' in line]
    assert len(taken) == 4
    assert min(taken) >= 3
    states.clear()
    probe.spin_until(lambda: states)
    towel = numbers(states[-1])[..., :3]
    assert np.isfinite(towel).all()
    low, high = np.percentile(towel.reshape(-1, 3), (1, 99), axis=0)
    assert (high - low)[:2] == pytest.approx((0.3, 0.3), abs=0.04)
    corners = towel[[0, 0, -1, -1], [0, -1, 0, -1], :2]
    assert np.ptp(corners, axis=0) == pytest.approx((0, 0), abs=0.07)
    assert 'rolled back' not in node.output
