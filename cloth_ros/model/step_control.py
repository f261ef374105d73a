"""
Step control: lengths of substeps while a cloth runs.

A substep is as long as is stable in every state of the cloth, or, where kicks are staggered, as
long as the present state allows.  Close to the stability limit the energy of the fastest modes
depends on the length, and each change of it may add to that energy.  So it is shortened where it
must be, and otherwise kept.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np

from ..scene import Scene
from ..scene.parameter import ParameterSpec, convert
from .integrators import StaggeredVerlet
from .integrators.integrator import SubstepBatch
from .present_stiffness import PresentStiffness
from .stability import PRESENT_SAFETY, group_bounds, rate_bounds
from .state import State, max_speed
from .time_step import (
    CHECK_INTERVAL,
    ROUNDING,
    accurate_substep,
    dissipation_interval,
    is_staggered,
    substep_division,
    substep_length,
    substep_of_travel,
)

_DIVISION = ParameterSpec('divisor of every substep', low=1, high=1000)
# Simulated time, s, for which a longer substep must have been possible; after a rejected batch,
# twice as long each time, up to the second number.
_PATIENCE, _MAX_PATIENCE = 0.25, 64.0
# Share by which it must be longer.
_WORTHWHILE = 0.02


class StepAccount(NamedTuple):
    """
    State of a step control.

    Attributes
    ----------
    substep
        Length of the substeps now, s.
    since
        Simulated time since which `longest` is measured, s.
    longest
        Length that every state since then has allowed, s.
    patience
        Time after which substeps are lengthened to that, s.

    """

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
    fresh
        True if `adapt` has to be called before the first advance.
    lengthened
        True if substeps are longer than in contact.
    division
        Divisor of every substep, for a finer solution.
    check_interval
        Substeps in slow motion from one call of `batches` to the next, at most.

    """

    substep: float
    division: int
    check_interval: int

    @property
    def fresh(self) -> bool:
        """True if `adapt` has to be called before the first advance."""
        ...

    @property
    def lengthened(self) -> bool:
        """True if substeps are longer than in contact."""
        ...

    def adapt(self, state: State, time: float, *, contact: bool) -> None:
        """
        Choose the length of the next substeps by the state at `time`, s.

        `contact` is True if a collider has been within reach.
        """
        ...

    def shorten(self, time: float) -> bool:
        """Make substeps as short as in contact: a batch was rejected; False if they are."""
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
        *,
        contact: bool = False,
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
        contact
            True if a collider is within reach.

        """
        ...


class ConstantStep:
    """Base of step controls whose substeps have one length."""

    fresh, lengthened = False, True

    def adapt(self, state: State, time: float, *, contact: bool) -> None:
        """Change nothing."""

    def shorten(self, time: float) -> bool:
        """Return False."""
        return False

    def account(self) -> StepAccount | None:
        """Return None."""
        return None

    def restore(self, account: StepAccount | None) -> None:
        """Change nothing."""


class AdaptiveStepControl:
    """
    Substeps of the length that `time_step` and the present state allow, divided in fast motion.

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
    division, check_interval
        As in every step control.

    Raises
    ------
    ValueError
        `division` is not a whole number from 1 to 1000.

    """

    def __init__(self, scene: Scene, *, division: int = 1) -> None:
        self.division: int = convert('division', division, 1, _DIVISION)
        self._scene = scene
        self._shortest = substep_length(scene)
        # A finer solution is advanced in the gaps between ticks, which are short.
        self.check_interval = CHECK_INTERVAL if self.division == 1 else 1
        _, self._viscous = rate_bounds(scene)
        _, self._others = group_bounds(scene)
        self._accurate = accurate_substep(scene)
        adaptive = is_staggered(scene) and not scene.solver.substeps
        self._present: PresentStiffness | None = None
        if adaptive and self._accurate > self._shortest:
            self._present = PresentStiffness(scene)
        self.restore(None)

    @property
    def fresh(self) -> bool:
        """True if the length is that of the start."""
        return self._since == -math.inf

    @property
    def lengthened(self) -> bool:
        """True if substeps are longer than in contact."""
        return self.substep > self._shortest

    def account(self) -> StepAccount | None:
        """Return the state of this control."""
        if self._present is None:
            return None
        return StepAccount(self.substep, self._since, self._longest, self._patience)

    def restore(self, account: StepAccount | None) -> None:
        """Return to a former state; None: to that at the start."""
        if account is None or self._present is None:
            account = StepAccount(self._shortest, -math.inf, math.inf, _PATIENCE)
        self.substep, self._since, self._longest, self._patience = account

    def adapt(self, state: State, time: float, *, contact: bool) -> None:
        """Choose the length of the next substeps by the state at `time`, s."""
        if self._present is None:
            self._since = time
            return
        possible = self._shortest if contact else self._possible(state)
        self._longest = min(self._longest, possible)
        if possible < self.substep:
            self._change(possible, time)
        elif time - self._since >= self._patience:
            longer = self._longest > (1 + _WORTHWHILE) * self.substep
            self._change(self._longest if longer else self.substep, time)

    def _possible(self, state: State) -> float:
        """Return the longest substep, s, that the present state allows; ticks are whole numbers."""
        assert self._present is not None
        stiffness = max(self._present.bound(state), self._others)
        longest = min(
            PRESENT_SAFETY * StaggeredVerlet.stable_step(stiffness, 0.0),
            self._accurate,
            substep_of_travel(self._scene, max_speed(state)),
        )
        if not longest > self._shortest:  # as for NaN
            return self._shortest
        tick = 1 / self._scene.rate
        return max(tick / math.ceil(tick / longest * (1 - ROUNDING)), self._shortest)

    def _change(self, substep: float, time: float) -> None:
        self.substep, self._since, self._longest = substep, time, math.inf

    def shorten(self, time: float) -> bool:
        """Make substeps as short as in contact: a batch was rejected; False if they are."""
        if not self.lengthened:
            return False
        self._change(self._shortest, time)
        self._patience = min(2 * self._patience, _MAX_PATIENCE)
        return True

    def batches(
        self,
        state: State,
        count: int,
        h: float,
        division: int,
        airspeed: float,
        *,
        contact: bool = False,
    ) -> Iterable[SubstepBatch]:
        """Return batches with substeps that are short enough for the present speed."""
        speed = max_speed(state)
        longest = self._shortest if contact else self.substep
        if h > longest:
            seconds, count = count * h, math.ceil(count * h / longest - ROUNDING)
            h = seconds / count
        fine = division * self.division * substep_division(self._scene, h, speed)
        interval = 1
        if state.dtype is np.float32:
            airspeed += speed
            interval = dissipation_interval(self._scene, h / fine, self._viscous, airspeed)
        return itertools.repeat(SubstepBatch(count, h / fine, interval), fine)
