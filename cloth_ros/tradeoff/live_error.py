"""How good the live error estimate is: beside it, the error against a much finer solution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..live.error_estimate import ErrorEstimator
from ..model import Cloth
from ..scene import Scene
from .run import Scenario

# By how much the substeps of what is taken for the truth are divided.
FINER = 16


@dataclass(frozen=True)
class Comparison:
    """
    An estimate beside the truth.

    Attributes
    ----------
    time, seconds
        End and length of the window, s of simulated time.
    estimate, truth
        Largest position error that has come up within it, m.

    """

    time: float
    seconds: float
    estimate: float
    truth: float


def compare(scene: Scene, scenario: Scenario) -> list[Comparison]:
    """Run a scene with its own solver parameters, estimating all the time; return every sample."""
    cloth = Cloth(scene)
    monitor = ErrorEstimator(cloth)
    exact = Cloth(scene.with_parameters({'solver.precision': 'double'}), finer=FINER)
    inputs: list[list[list[float]]] = []
    comparisons = []
    for tick in scenario.ticks(cloth):
        if not inputs:
            exact.adopt(cloth)
        inputs.append([point.tolist() for point in cloth.sphere_waypoints])
        before = cloth.positions
        monitor.observe(tick)
        cloth.advance(tick)
        last = monitor.estimate
        monitor.work(math.inf)
        estimate = monitor.estimate
        if estimate is not None and estimate is not last:
            # The window ended before this tick, which the monitor has not taken part of.
            for waypoints in inputs[:-1]:
                for point in waypoints:
                    exact.move_sphere(point)
                exact.advance(tick)
            truth = float(np.linalg.norm(exact.positions - before, axis=-1).max())
            comparisons.append(
                Comparison(estimate.time, estimate.seconds, estimate.largest, truth)
            )
            inputs = []
    return comparisons
