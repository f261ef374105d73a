"""Estimates of a live cloth are the errors that a finer run finds, in each scene with motion."""

import math

import numpy as np
import pytest
from builders import SCENE_FILES
from recordings import record
from sessions import poses

from cloth_ros import Scene
from cloth_ros.recording import run
from cloth_ros.recording.resimulation import Settings

TICKS = 300
# One scene of each kind of motion; all of them take ten minutes.
MOVING = [path for path in SCENE_FILES if path.stem in ('flag', 'table', 'small_fast_sphere')]


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize('path', MOVING, ids=lambda path: path.stem)
def test_most_estimates_are_within_a_factor_of_three_of_the_error_found(path, tmp_path):
    scene = Scene.from_yaml(path)

    def act(live, tick):
        live.set_wind((0.0, 2.0 * math.sin(tick / 12), 0.0))
        for name, message in poses(path, scene, tick / scene.rate).items():
            place, turn = message.pose.position, message.pose.orientation
            live.bodies.move(name, (place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))

    bag = record(tmp_path / 'bag', scene, TICKS, act, estimate=math.inf)
    found = run.check_estimates(bag, None, Settings(), lambda *_: None).result['estimates']
    ratios = np.array([each['largest'] / each['found'] for each in found])
    assert len(ratios) >= 6
    assert 0.7 < np.median(ratios) < 2.0
    # Sheets that fold are chaotic: now and then both solutions part at once.  On a moving table
    # 8 of 52 estimates were 3 to 5 times too large.
    assert np.mean((ratios > 1 / 3) & (ratios < 3)) >= 0.8, ratios
