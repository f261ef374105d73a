"""The program that folds a towel, against a running node."""

import sys
import time

import numpy as np
import pytest
from folded_sheet import covered, layers
from ros import ROOT, numbers, stamp
from self_intersection import intersecting_edges
from sensor_msgs.msg import PointCloud2

from cloth_ros import Scene

SCENE = ROOT / 'config' / 'towel.yaml'
FOLDER = (sys.executable, str(ROOT / 'examples' / 'fold_towel.py'))
# One state in so many is searched for intersections: that takes longer than the fold.
EACH = 8
LONGEST = 1200.0  # s, on a machine that is busy with other work


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.timeout(2 * LONGEST)
def test_the_towel_is_folded_in_four_layers(start_cloth, start, probe, record_property):
    """
    No triangles intersect on the way; the end is a quarter of the area, in four layers.

    A machine that is too slow takes longer: the program follows the simulated time.
    """
    node = start_cloth('--params-file', str(SCENE))
    states = probe.collect(PointCloud2, '/cloth/particles', 1000)
    begin = time.monotonic()
    program = start(*FOLDER)
    while program.alive:
        assert time.monotonic() < begin + LONGEST, program.output
        probe.spin_for(0.2)
    taken = time.monotonic() - begin
    assert program.stop(0) == 0, program.output + node.output
    held = [int(line.split()[2]) for line in program.output.splitlines() if ' holds ' in line]
    assert len(held) == 4, program.output
    assert min(held) >= 3
    probe.spin_for(1.0)
    assert 'rolled back' not in node.output
    # The program has reset the cloth, and with it the time.
    first = int(np.argmin([stamp(each) for each in states]))
    folding = states[first:]
    factor = stamp(folding[-1]) / taken
    record_property('real-time factor', f'{factor:.2f}')
    print(f'{len(folding)} states, real-time factor {factor:.2f}')
    assert len(folding) > 500

    for state in folding[::EACH]:
        pierced = intersecting_edges(numbers(state)[..., :3])
        assert not len(pierced), f'{stamp(state)} s: {pierced}'

    towel = numbers(folding[-1])[..., :3].astype(float)
    quarter = np.prod(Scene.from_yaml(SCENE).sheet.size) / 4
    region = covered(towel)
    assert region.area == pytest.approx(quarter, rel=0.05)
    west, south, east, north = region.bounds
    assert (east - west, north - south) == pytest.approx((0.3, 0.3), rel=0.07)
    assert (layers(towel) == 4).mean() > 0.85
    assert np.ptp(towel[..., 2]) < 0.06
    # At rest, but for single particles where both folds meet.
    assert np.percentile(np.linalg.norm(numbers(folding[-1])[..., 3:], axis=-1), 95) < 0.05
    print(f'area / quarter {region.area / quarter:.3f}, height {np.ptp(towel[..., 2]):.3f} m')
