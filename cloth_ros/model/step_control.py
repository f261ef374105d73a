"""
Step control: lengths of substeps while a cloth runs.

Substeps are as long as the present state of the cloth allows.  Close to the stability limit the
energy of the fastest modes depends on that length, and each change of it may add to that energy:
a flag whose substeps are divided whenever its end is fast gains more from this than from the
wind.  So substeps are shortened when they must be, and lengthened only after some time in which
they could have been longer.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np

from ..scene import Scene
from ..scene.parameter import ParameterSpec, convert
from .integrators.integrator import SubstepBatch
from .present_stiffness import PresentStiffness
from .stability import PRESENT_SAFETY, rate_bounds
from .state import State, max_speed
from .time_step import (
    BATCH,
    CHECK_INTERVAL,
    ROUNDING,
    accurate_substep,
    adapts_to_state,
    dissipation_interval,
    integrator_for,
    substep_division,
    substep_length,
    substep_of_travel,
    whole_substep,
)

_DIVISION = ParameterSpec('divisor of every substep', low=1, high=1000)
# Simulated time, s, for which a longer substep must have been possible; after a rejected batch,
# twice as long each time, up to the second number.
_PATIENCE, _MAX_PATIENCE = 1.0, 64.0
# Share of the length that fast motion allows: faster motion within a tick divides no substep.
_TRAVEL = 0.7
# Share of the length that is stable in every state down to which fast motion shortens substeps.
_SHORTEST = 0.125
# Share by which it must be longer.
_WORTHWHILE = 0.02
# Rest lengths that the fastest particle may move before the next check in calm motion; and
# substeps until then times particles, some milliseconds of wall-clock time.
_CALM, _AT_ONCE = 4.0, 1_200_000


class StepAccount(NamedTuple):
    """
    State of a step control.

    Attributes
    ----------
    stable
        Length that is stable in every state of the scene, s.
    substep
        Length of the substeps now, s.
    since
        Simulated time since which `longest` is measured, s.
    longest
        Length that every state since then has allowed, s.
    patience
        Time after which substeps are lengthened to that, s.

    """

    stable: float
    substep: float
    since: float
    longest: float
    patience: float


class StepControl(Protocol):
    """
    Divides an interval of time into substeps.

    Attributes
    ----------
    substep
        Length in slow motion now, s.
    division
        Divisor of every substep, for a finer solution.
    adapt_interval
        Simulated time from one call of `adapt` to the next, s.

    """

    substep: float
    division: int
    adapt_interval: float

    def begin(self, state: State, time: float) -> None:
        """Choose the length of the first substeps, unless that has been done."""
        ...

    def adapt(self, state: State, time: float) -> None:
        """Choose the length of the next substeps by the state at `time`, s."""
        ...

    def shorten(self, time: float) -> bool:
        """Make substeps stable in every state: a batch was rejected; False if they are."""
        ...

    def check_interval(self, state: State, h: float) -> int:
        """Return after how many substeps of `h` s, at most, to call `batches` again."""
        ...

    def account(self) -> StepAccount | None:
        """Return the state of this control; None: it has none."""
        ...

    def restore(self, account: StepAccount | None) -> None:
        """Return to a former state; None: to that at the start."""
        ...

    def batches(
        self,
        state: State,
        count: int,
        h: float,
        division: int,
        airspeed: float,
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


class ConstantStep:
    """Base of step controls whose substeps have one length."""

    adapt_interval = math.inf

    def begin(self, state: State, time: float) -> None:
        """Change nothing."""

    def adapt(self, state: State, time: float) -> None:
        """Change nothing."""

    def shorten(self, time: float) -> bool:
        """Return False."""
        return False

    def check_interval(self, state: State, h: float) -> int:
        """Return a constant."""
        return CHECK_INTERVAL

    def account(self) -> StepAccount | None:
        """Return None."""
        return None

    def restore(self, account: StepAccount | None) -> None:
        """Change nothing."""


class AdaptiveStepControl:
    """
    Substeps that follow the present state, divided where fast motion needs it within a tick.

    Parameters
    ----------
    scene
        Parameters.
    division
        Divides every substep.

    Attributes
    ----------
    substep
        Length in slow motion now, s.
    division, adapt_interval
        As in every step control.

    Raises
    ------
    ValueError
        `division` is not a whole number from 1 to 1000.

    """

    def __init__(self, scene: Scene, *, division: int = 1) -> None:
        self.division: int = convert('division', division, 1, _DIVISION)
        self._scene = scene
        number = scene.sheet.rows * scene.sheet.columns
        intervals = _AT_ONCE // (number * CHECK_INTERVAL)
        self._calm_interval = min(max(intervals, 1) * CHECK_INTERVAL, BATCH)
        self._calm = _CALM * scene.sheet.shortest_spacing
        _, self._viscous = rate_bounds(scene)
        self._stable = substep_length(scene)
        self._accurate = accurate_substep(scene)
        # Whether accuracy asks for substeps that are stable in every state.
        self._limited = whole_substep(scene, self._accurate) <= (1 + ROUNDING) * self._stable
        self._stable_step = integrator_for(scene).stable_step
        self._present = PresentStiffness(scene) if adapts_to_state(scene) else None
        self.adapt_interval = math.inf if self._present is None else 1 / scene.rate
        self.restore(None)

    def account(self) -> StepAccount | None:
        """Return the state of this control."""
        if self._present is None:
            return None
        now = (self.substep, self._since, self._longest, self._patience)
        return StepAccount(self._stable, *now)

    def restore(self, account: StepAccount | None) -> None:
        """Return to a former state; None, or one of another stiffness: to that at the start."""
        if account is None or self._present is None or account.stable != self._stable:
            account = StepAccount(self._stable, self._stable, -math.inf, math.inf, _PATIENCE)
        _, self.substep, self._since, self._longest, self._patience = account

    def begin(self, state: State, time: float) -> None:
        """Choose the length of the first substeps, unless that has been done."""
        if self._since == -math.inf:
            self.adapt(state, time)

    def adapt(self, state: State, time: float) -> None:
        """Choose the length of the next substeps by the state at `time`, s."""
        if self._present is None:
            return
        possible = self._possible(state, self._present_stable(state, self._present))
        self._longest = min(self._longest, possible)
        if possible < self.substep:
            self._change(possible, time)
        elif time - self._since >= self._patience:
            longer = self._longest > (1 + _WORTHWHILE) * self.substep
            self._change(self._longest if longer else self.substep, time)

    def check_interval(self, state: State, h: float) -> int:
        """Return after how many substeps of `h` s, at most, to call `batches` again."""
        if self.division > 1:  # advanced in the gaps between ticks, which are short
            return 1
        # False for NaN.
        calm = self._calm_interval * h * max_speed(state) < self._calm
        return self._calm_interval if calm else CHECK_INTERVAL

    def _present_stable(self, state: State, present: PresentStiffness) -> float:
        """Return the longest substep, s, that is stable in the present state, as far as of use."""
        if self._limited:
            return self._stable
        longest = self._stable_step(present.bound(state), self._viscous)
        return max(PRESENT_SAFETY * longest, self._stable)

    def _possible(self, state: State, stable: float) -> float:
        """Return the longest substep, s, up to a stable one, that accuracy and speed allow."""
        travel = _TRAVEL * substep_of_travel(self._scene, max_speed(state))
        longest = min(stable, self._accurate, max(travel, _SHORTEST * self._stable))
        # False where not finite.
        return whole_substep(self._scene, longest) if longest > 0 else self._stable

    def _change(self, substep: float, time: float) -> None:
        self.substep, self._since, self._longest = substep, time, math.inf

    def shorten(self, time: float) -> bool:
        """Make substeps stable in every state: a batch was rejected; False if they are."""
        if self._present is None or self.substep <= self._stable:
            return False
        self._change(self._stable, time)
        self._patience = min(2 * self._patience, _MAX_PATIENCE)
        return True

    def batches(
        self, state: State, count: int, h: float, division: int, airspeed: float
    ) -> Iterable[SubstepBatch]:
        """Return batches with substeps that are short enough for the present speed."""
        speed = max_speed(state)
        if h > (1 + ROUNDING) * self.substep:  # shortened since the start of the advance
            seconds, count = count * h, math.ceil(count * h / self.substep - ROUNDING)
            h = seconds / count
        fine = division * self.division * substep_division(self._scene, h, speed)
        interval = 1
        if state.dtype is np.float32:
            airspeed += speed
            interval = dissipation_interval(self._scene, h / fine, self._viscous, airspeed)
        return itertools.repeat(SubstepBatch(count, h / fine, interval), fine)
