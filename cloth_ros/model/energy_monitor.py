"""
Energy monitor: rejects a batch of substeps that ends with too much energy.

The substep is stable for every frozen state of the cloth, and shorter in fast motion; neither is
a proof for a moving cloth.  So the energy is measured after every batch of substeps and compared
with a budget: the energy before, and the work of air and colliders since.  Drag, dashpots and the
air, where it slows down, only take from it.  A batch that ends above the budget, or with a number
that is not finite, is rolled back and repeated by `Simulation`:

1. refined, with substeps that are stable in every state if they were longer, then divided by 4,
   and by 16, which remain for a while;
2. if there is still too much, the velocities are scaled down to the budget;
3. if that is not possible, damped, with the integrator whose energy cannot grow;
4. and if even that is not finite, the cloth is held for the batch, and continues from rest.

Energy limits have been used in this way before (D. Dinev, T. Liu, L. Kavan, "Stabilizing
Integrators for Real-Time Physics", ACM Transactions on Graphics 37, 2018).
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import NamedTuple

import numpy as np

from ..scene import Scene
from .energy import Energy, EnergyMeter
from .stability import rate_bounds
from .state import State

# Divisors of substeps when a batch is repeated.
DIVISIONS = (1, 4, 16)
# Accepted batches in a row before longer substeps are tried again.  Twice as many each time that
# these are rejected; up to a minute or so.
_PATIENCE, _MAX_PATIENCE = 32, 4096
# Divisor of substeps of the damped integrator: h² λ is then (2 · 0.9 / 8)² at most.
DAMPED_DIVISION = 8

# Share of the energy in motion that a batch may add.  Position Verlet keeps the energy of an
# oscillator but for an oscillation by a factor of up to 1/(1 − (ω h/2)²).
_TOLERANCE = 0.03
# The same in a batch with contact, which also moves particles without velocity.
_TOUCHED = 0.1
# Springs elongated by so many roundings of a position hold an energy that counts as none.
_ROUNDINGS = 64
# Energy that rounding in single precision may add per second, J/kg divided by the square of the
# diagonal in m; see `precision.MAX_ROUNDING_HEATING_RATE`.
_SLOW = 0.05
# Share of the unused budget that is dropped in each batch: energy taken by drag must not return.
_DROPPED = 0.125


@dataclass
class RollbackCounts:
    """
    Number of batches of substeps that were rolled back and repeated.

    Attributes
    ----------
    refined
        With shorter substeps.
    limited
        With these, and velocities that were then scaled down.
    damped
        With the integrator whose energy cannot grow.
    held
        Not at all: the cloth was held where it was.

    """

    refined: int = 0
    limited: int = 0
    damped: int = 0
    held: int = 0

    def since(self, before: RollbackCounts) -> RollbackCounts:
        """Return the difference from an earlier count."""
        counts = zip(astuple(self), astuple(before), strict=True)
        return RollbackCounts(*(now - then for now, then in counts))

    @property
    def text(self) -> str:
        """The counts in words; empty if all are zero."""
        return ', '.join(f'{count} {name}' for name, count in vars(self).items() if count)


class EnergyAccount(NamedTuple):
    """
    State of an energy monitor.

    Attributes
    ----------
    energy
        Measured after the last accepted batch.
    budget
        Total energy that the cloth may have, J.
    division
        Divisor of substeps.
    accepted, patience
        Batches accepted in a row, and how many there must be before longer substeps are tried.

    """

    energy: Energy
    budget: float
    division: int
    accepted: int
    patience: int


class EnergyMonitor:
    """
    Accepts or rejects batches of substeps by their energy.

    Parameters
    ----------
    scene
        Parameters.
    dtype
        Precision of the state.

    Attributes
    ----------
    division
        Present divisor of substeps.
    work
        Of air and colliders in the last accepted batch, J.

    """

    def __init__(self, scene: Scene, dtype: type) -> None:
        self.work = 0.0
        self._meter = EnergyMeter(scene, dtype)
        sheet = scene.sheet
        weight = sheet.mass * float(np.linalg.norm(scene.gravity))
        self._fall = weight * sheet.diagonal
        rounding = _ROUNDINGS * float(np.finfo(dtype).eps) * sheet.diagonal
        elastic, _ = rate_bounds(scene)
        self._least = sheet.mass * elastic * rounding**2
        if dtype is np.float32:
            self._least += _SLOW * sheet.mass * sheet.diagonal**2
        self._tolerance = _TOLERANCE
        if scene.solver.substeps:
            # With a step that the user has fixed, the integrator makes of the energy E of an
            # oscillator up to E / (1 − φ), which is φ of itself more than E.
            step = 1 / (scene.rate * scene.solver.substeps)
            self._tolerance = max(_TOLERANCE, 0.25 * step**2 * elastic)
        self.reset()

    def reset(self) -> None:
        """Start again from the present state: it was assigned from outside."""
        self._energy: Energy | None = None
        self.division, self._accepted, self._patience = 1, 0, _PATIENCE

    def begin_batch(self, state: State) -> None:
        """Measure the energy before a batch, if the last batch has not."""
        if self._energy is None:
            self._energy = self._meter.measure(state)
            self._budget = self._energy.total

    def account(self) -> EnergyAccount | None:
        """Return the state of this monitor; None before the first batch."""
        if self._energy is None:
            return None
        division, accepted, patience = self.division, self._accepted, self._patience
        return EnergyAccount(self._energy, self._budget, division, accepted, patience)

    def restore(self, account: EnergyAccount | None) -> None:
        """Return to a former state of this monitor."""
        self.reset()
        if account is not None:
            (self._energy, self._budget, self.division, self._accepted, self._patience) = account

    def accepts(self, state: State, work: float, *, touched: bool = False) -> bool:
        """
        Return whether the state after a batch is within its budget; account for it if so.

        Parameters
        ----------
        state
            After the batch.
        work
            Of air and colliders in the batch, J; inf if it is unknown.
        touched
            True if there was contact: it moves particles out of the collider, and the energy that
            this adds, within the tolerance, is work of the collider as well.

        """
        end = self._meter.measure(state)
        if not math.isfinite(end.total):
            return False
        if work == math.inf:
            work = end.total - self._budget
        tolerance = max(self._tolerance, _TOUCHED) if touched else self._tolerance
        if not self._excess(end, work, tolerance) <= 0.0:  # True for NaN
            return False
        if touched:
            most = work + _TOUCHED * self._turnover(end, work) + self._least
            work = max(work, min(end.total - self._budget, most))
        self.work = work
        self._budget += work
        self._budget -= _DROPPED * max(self._budget - end.total, 0.0)
        self._accepted += 1
        if self._accepted >= self._patience and self.division > 1:
            self.division, self._accepted = DIVISIONS[DIVISIONS.index(self.division) - 1], 0
        self._energy = end
        return True

    def _excess(self, end: Energy, work: float, tolerance: float) -> float:
        """Return the energy above the budget and its tolerance, J."""
        allowed = self._budget + work + tolerance * self._turnover(end, work) + self._least
        return end.total - allowed

    def _turnover(self, end: Energy, work: float) -> float:
        """Return the energy that the batch has converted, J."""
        assert self._energy is not None
        return max(self._energy.motion, end.motion) + abs(work) + self._fall

    def refine(self) -> None:
        """Divide substeps further until enough batches have been accepted."""
        self.division = DIVISIONS[DIVISIONS.index(self.division) + 1]
        self._accepted, self._patience = 0, min(2 * self._patience, _MAX_PATIENCE)

    def rescale_velocities(self, state: State, work: float) -> bool:
        """Scale velocities down to the budget; return whether that is possible."""
        end = self._meter.measure(state)
        excess = end.total - self._budget - work
        # False for NaN.
        if not (0.0 < excess <= end.kinetic and math.isfinite(end.kinetic)):
            return False
        state.velocity *= state.dtype(math.sqrt(1.0 - excess / end.kinetic))
        return True
