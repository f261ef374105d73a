"""Step control: lengths of substeps while a cloth runs."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Protocol

import numpy as np

from ..scene import Scene
from ..scene.parameter import ParameterSpec, convert
from .integrators.integrator import SubstepBatch
from .stability import rate_bounds
from .state import State, max_speed
from .time_step import CHECK_INTERVAL, dissipation_interval, substep_division, substep_length

_DIVISION = ParameterSpec('divisor of every substep', low=1, high=1000)


class StepControl(Protocol):
    """
    Divides an interval of time into substeps.

    Attributes
    ----------
    substep
        Length in slow motion, s.
    division
        Divisor of every substep, for a finer solution.
    check_interval
        Substeps in slow motion from one call of `batches` to the next, at most.

    """

    substep: float
    division: int
    check_interval: int

    def batches(
        self, state: State, count: int, h: float, division: int, airspeed: float
    ) -> Iterable[SubstepBatch]:
        """
        Return batches that together last for `count` times `h` s.

        Parameters
        ----------
        state
            The cloth at their start.
        count, h
            Number of substeps in slow motion, and their length, s.
        division
            Divisor required by the energy monitor.
        airspeed
            Speed of the air, m/s.

        """
        ...


class AdaptiveStepControl:
    """
    Substeps of the length that `time_step` chooses, divided further in fast motion.

    Parameters
    ----------
    scene
        Parameters.
    division
        Divides every substep.

    Raises
    ------
    ValueError
        `division` is not a whole number from 1 to 1000.

    """

    def __init__(self, scene: Scene, *, division: int = 1) -> None:
        self.division: int = convert('division', division, 1, _DIVISION)
        self.substep = substep_length(scene)
        self._scene = scene
        # A finer solution is advanced in the gaps between ticks, which are short.
        self.check_interval = CHECK_INTERVAL if self.division == 1 else 1
        _, self._viscous = rate_bounds(scene)

    def batches(
        self, state: State, count: int, h: float, division: int, airspeed: float
    ) -> Iterable[SubstepBatch]:
        """Return batches with substeps that are short enough for the present speed."""
        speed = max_speed(state)
        fine = division * self.division * substep_division(self._scene, h, speed)
        interval = 1
        if state.dtype is np.float32:
            airspeed += speed
            interval = dissipation_interval(self._scene, h / fine, self._viscous, airspeed)
        return itertools.repeat(SubstepBatch(count, h / fine, interval), fine)
