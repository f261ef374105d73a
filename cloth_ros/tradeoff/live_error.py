"""Accuracy of the live error estimate: compare it with the error against a much finer solution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..live.error_estimate import ErrorEstimator
from ..model import Cloth, Inputs
from ..model.step_control import AdaptiveStepControl
from ..scene import Scene
from .run import Scenario

# Division of the substeps of the solution that counts as exact.
DIVISION = 16


@dataclass(frozen=True)
class Comparison:
    """
    Estimated and true error of one window of simulated time.

    Attributes
    ----------
    time, seconds
        End and length of the window, s of simulated time.
    estimate, truth
        Largest position error that has arisen within it, m.

    """

    time: float
    seconds: float
    estimate: float
    truth: float


def compare(scene: Scene, scenario: Scenario) -> list[Comparison]:
    """
    Run a scene with its own solver parameters and compare every estimate of its error.

    Each window starts from the state that the cloth has then: the error that it had before the
    window does not count.
    """
    cloth = Cloth(scene)
    estimator = ErrorEstimator(cloth)
    exact = Cloth(
        scene.with_parameters({'solver.precision': 'double'}),
        step_control=partial(AdaptiveStepControl, division=DIVISION),
    )
    inputs: list[Inputs] = []
    comparisons = []
    for tick in scenario.ticks(cloth):
        if not inputs:
            exact.restore(cloth.snapshot())
        inputs.append(cloth.inputs)
        before = cloth.positions
        estimator.observe(tick)
        cloth.advance(tick)
        last = estimator.estimate
        estimator.work(math.inf)
        estimate = estimator.estimate
        if estimate is not None and estimate is not last:
            # The window ended before this tick.
            for each in inputs[:-1]:
                exact.advance(tick, each)
            truth = float(np.linalg.norm(exact.positions - before, axis=-1).max())
            comparisons.append(
                Comparison(estimate.time, estimate.seconds, estimate.largest, truth)
            )
            inputs = []
    return comparisons
