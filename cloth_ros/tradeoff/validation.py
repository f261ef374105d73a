"""Comparison of a simulated system with its closed solution."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..model.grid import Array

# Simulated value, exact value, and tolerated relative difference.
Measurement = tuple[float | Array, float | Array, float]


@dataclass(frozen=True, eq=False)
class Result:
    """
    Result of an integrator for a system.

    Attributes
    ----------
    system, method
        Names of system and integrator.
    found, exact
        Simulated and exact values in the unit of the system; numbers, or arrays of one shape.
    tolerance
        Tolerated relative difference.

    """

    system: str
    method: str
    found: float | Array
    exact: float | Array
    tolerance: float

    @property
    def error(self) -> float:
        """Largest relative difference; inf if a value is not finite."""
        found, exact = np.asarray(self.found, float), np.asarray(self.exact, float)
        error = float(np.max(np.abs(found - exact) / np.abs(exact)))
        return error if math.isfinite(error) else math.inf

    @property
    def holds(self) -> bool:
        """True if the difference is tolerated."""
        return self.error <= self.tolerance


@dataclass(frozen=True)
class AnalyticCase:
    """
    A system with a closed solution.

    Attributes
    ----------
    name
        Of the system.
    text
        The solution, in one line.
    unit
        Of the solution.
    parameter
        Name of a parameter that the solution depends on: tests change it by 1 %, and expect the
        difference to be detected.
    run
        Function of the name of an integrator: simulates the system, and returns the simulated
        value, the exact value and the tolerated relative difference.

    """

    name: str
    text: str
    unit: str
    parameter: str
    run: Callable[[str], Measurement]

    def measure(self, method: str) -> Result:
        """Simulate the system with an integrator and compare."""
        return Result(self.name, method, *self.run(method))
