"""
The last guard: a cloth has no energy but what it had, and what was done to it.

The substep is stable for every frozen state of the cloth, and a cloth in fast motion is given
shorter ones; both are no proof.  So the energy is measured, after every stretch of substeps, and
compared with a budget: what it was, and the work of the air and of the sphere since.  Drag,
dashpots and the air, where it slows down, only take from it.  A stretch after which there is more,
or a number that is not finite, is repeated from the last good state:

1. finer, with substeps divided by 4, then by 16, which are kept for a while;
2. if that leaves too much, the velocities are scaled down to what the budget has;
3. if they cannot give that much, with the method whose energy cannot grow, `damped_euler`;
4. and should even its numbers not be finite, the cloth is held for the stretch, and goes on from
   rest.

Energy has the last word in other solvers too (D. Dinev, T. Liu, L. Kavan, "Stabilizing Integrators
for Real-Time Physics", ACM Transactions on Graphics 37, 2018).
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np

from ..scene import Scene
from .energy import Energy, EnergyMeter
from .grid import Array
from .state import State
from .time_step import CHECK_INTERVAL

# Substeps between two looks at the energy, at most.
BATCH = 4 * CHECK_INTERVAL
# By what substeps are divided when a stretch is repeated.
DIVISIONS = (1, 4, 16)
# Stretches in a row that must be good before longer substeps are tried again.  Each time that
# these are no good, twice as many; up to a minute or so.
_PATIENCE, _LONGEST_PATIENCE = 32, 4096
# Substeps of the last method are divided by this: h² λ is then (2 · 0.9 / 8)² at most.
DAMPED_DIVISION = 8

# Share of the energy in motion that may be too much.  Position Verlet keeps the energy of an
# oscillator but for an oscillation by a factor of up to 1/(1 − (ω h/2)²).
_TOLERANCE = 0.03
# The same in a stretch in which the sphere touches: it also moves particles, without velocity.
_TOUCHED = 0.1
# Springs that are stretched by as many roundings of a position hold what counts as no energy.
_ROUNDINGS = 64
# What rounding in single precision may add in a second, J/kg by the square of the diagonal in m;
# see `substeps.HEATING`.
_SLOW = 0.05
# Share of what the budget has too much that it forgets in a stretch: what drag has taken must not
# come back.
_FORGETTING = 0.125


@dataclass
class RollbackCounts:
    """
    How often a stretch of substeps had to be made again.

    Attributes
    ----------
    finer
        With shorter substeps.
    limited
        With these, and velocities that were then scaled down.
    damped
        With the method whose energy cannot grow.
    held
        Not at all: the cloth was held where it was.

    """

    finer: int = 0
    limited: int = 0
    damped: int = 0
    held: int = 0

    def since(self, before: RollbackCounts) -> RollbackCounts:
        """Return what has come on top of another count."""
        counts = zip(astuple(self), astuple(before), strict=True)
        return RollbackCounts(*(now - then for now, then in counts))

    @property
    def text(self) -> str:
        """What has happened, in words; empty if nothing has."""
        return ', '.join(f'{count} {name}' for name, count in vars(self).items() if count)


class EnergyMonitor:
    """
    Keeps the budget of a cloth, and its last good state.

    Parameters
    ----------
    scene
        What is simulated.
    dtype
        Precision of the state.
    repeats
        Where to count what had to be made again.

    Attributes
    ----------
    division
        By what substeps are divided at present.
    work
        Of air and sphere in the last stretch, J.

    """

    def __init__(self, scene: Scene, dtype: type, rollbacks: RollbackCounts) -> None:
        self.division = 1
        self.rollbacks = rollbacks
        self.work = 0.0
        self._calm, self._patience = 0, _PATIENCE
        self._meter = EnergyMeter(scene, dtype)
        sheet = scene.sheet
        weight = sheet.mass * float(np.linalg.norm(scene.gravity))
        self._fall = weight * sheet.diagonal
        rounding = _ROUNDINGS * float(np.finfo(dtype).eps) * sheet.diagonal
        self._least = sheet.mass * scene.rate_bounds()[0] * rounding**2
        if dtype is np.float32:
            self._least += _SLOW * sheet.mass * sheet.diagonal**2
        self._tolerance = _TOLERANCE
        if scene.solver.substeps:
            # The step is as the user wants it, and so is what the method makes of an oscillator:
            # energy E / (1 − φ), which is φ of itself more than E.
            step = 1 / (scene.rate * scene.solver.substeps)
            self._tolerance = max(_TOLERANCE, 0.25 * step**2 * scene.rate_bounds()[0])
        self._good: tuple[Array, Array, Array] | None = None

    @property
    def has_state(self) -> bool:
        """True if there is a last good state."""
        return self._good is not None

    def forget(self) -> None:
        """Take the present state for good: it was set from outside."""
        self._good = None
        self.division, self._calm, self._patience = 1, 0, _PATIENCE

    def open(self, state: State) -> None:
        """Begin a stretch."""
        if self._good is None:
            self._now = self._meter.measure(state)
            self._budget = self._now.total
            self._good = (state.origin, state.position.copy(), state.velocity.copy())

    def _keep(self, state: State) -> None:
        """Take a state for good."""
        assert self._good is not None
        _, position, velocity = self._good
        position[...], velocity[...] = state.position, state.velocity
        self._good = (state.origin, position, velocity)

    def go_back(self, state: State) -> None:
        """Return to the last good state."""
        assert self._good is not None
        state.origin, position, velocity = self._good
        state.position[...], state.velocity[...] = position, velocity

    def accepts(self, state: State, work: float, *, touched: bool = False) -> bool:
        """
        Tell if the state after a stretch is within its budget, and then take it for good.

        Parameters
        ----------
        state
            After the stretch.
        work
            Done by the air and the sphere in it, J; inf if that is not known.
        touched
            True if the sphere has touched the sheet: it moves particles out of itself, and what
            that adds to their energy, within the tolerance, is its work as well.

        """
        end = self._meter.measure(state)
        if not math.isfinite(end.total):
            return False
        if work == math.inf:
            work = end.total - self._budget
        tolerance = max(self._tolerance, _TOUCHED) if touched else self._tolerance
        if not self._excess(end, work, tolerance) <= 0.0:  # NaN is no good either
            return False
        if touched:
            most = work + _TOUCHED * self._turnover(end, work) + self._least
            work = max(work, min(end.total - self._budget, most))
        self.work = work
        self._budget += work
        self._budget -= _FORGETTING * max(self._budget - end.total, 0.0)
        self._calm += 1
        if self._calm >= self._patience and self.division > 1:
            self.division, self._calm = DIVISIONS[DIVISIONS.index(self.division) - 1], 0
        self._now = end
        self._keep(state)
        return True

    def _excess(self, end: Energy, work: float, tolerance: float) -> float:
        """Return the energy that is too much, J; what the tolerance allows is not."""
        allowed = self._budget + work + tolerance * self._turnover(end, work) + self._least
        return end.total - allowed

    def _turnover(self, end: Energy, work: float) -> float:
        """Return the energy that the stretch has turned over, J."""
        return max(self._now.motion, end.motion) + abs(work) + self._fall

    def divide(self, division: int) -> None:
        """Divide substeps from here on, until stretches have been good for a while."""
        self.division = division
        self.rollbacks.finer += 1
        self._calm, self._patience = 0, min(2 * self._patience, _LONGEST_PATIENCE)

    def limit(self, state: State, work: float) -> bool:
        """Scale velocities down to what the budget allows; return whether that is possible."""
        end = self._meter.measure(state)
        excess = end.total - self._budget - work
        # NaN compares as false.
        if not (0.0 < excess <= end.kinetic and math.isfinite(end.kinetic)):
            return False
        state.velocity *= state.dtype(math.sqrt(1.0 - excess / end.kinetic))
        self.rollbacks.limited += 1
        return True
