"""How far single precision is from double in the hanging scene, and why not nearer."""

from pathlib import Path

import numpy as np
import pytest

from cloth_ros import Cloth, Scene

ROOT = Path(__file__).parent.parent


def run(precision: str, disturbance: float = 0.0) -> np.ndarray:
    """Return the positions after each tick of the first second, m."""
    scene = Scene.from_yaml(ROOT / 'config/hanging.yaml')
    cloth = Cloth(scene.with_parameters({'solver.precision': precision}))
    noise = np.random.default_rng(0).normal(0, 1, cloth.positions.shape)
    cloth.positions = cloth.positions + disturbance * noise
    ticks = []
    for _ in range(60):
        cloth.advance(1 / 60)
        ticks.append(cloth.positions)
    return np.array(ticks)


@pytest.fixture(scope='module')
def double() -> np.ndarray:
    return run('double')


def distance(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the largest distance of a particle after each tick, m."""
    return np.linalg.norm(one - other, axis=-1).max(axis=(1, 2))


def test_single_precision_is_within_a_tenth_of_a_millimetre_until_the_sheet_folds(double):
    assert distance(run('single'), double)[:18].max() < 1e-4  # 0.3 s


def test_then_a_disturbance_far_below_it_parts_two_runs_as_far(double):
    """A sheet that falls from the flat folds, and the least disturbance decides where."""
    disturbed = distance(run('double', 1e-9), double).max()
    assert disturbed > 1e-4
    assert distance(run('single'), double).max() < 4 * disturbed
