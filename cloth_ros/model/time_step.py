"""Which method, and how long its substeps: stable always, accurate as asked, finer where free."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from . import stability
from .integrators import INTEGRATORS, Integrator
from .integrators.position_verlet import PositionVerlet

if TYPE_CHECKING:
    from ..scene import Scene

# A share of a substep by which a count may be rounded down: a time that is a whole number of
# substeps but for rounding is not given one more.
ROUNDING = 1e-6

# Phase, rad, that the stiffest mode turns in a substep when its frequency is right within 0.1 %:
# that of the explicit methods is (2/h) asin(ω h/2).
_RESOLVED = 0.15
# Particle steps per second that no machine notices, and shortest substep, s, that is taken for
# it.  Small sheets are resolved better for them.
_CHEAP = 3e6
_SHORTEST = 2.5e-4

# Tolerance, m, that single precision is good for.
_SINGLE = 1e-3
# Heating by rounding, 1/s, that single precision is good for: the share of the energy of a fall
# by the sheet's own length (or of a speed of that length in a second) that it adds in a second.
MAX_ROUNDING_HEATING_RATE = 0.05

# Share of the shortest rest length that the fastest particle may move in a substep, and the
# finest division of a substep to that end.
_TRAVEL = 0.2
_FINEST = 8
# Substeps from one look at the speed to the next.
CHECK_INTERVAL = 17
# Dissipation acts once in so many substeps at most, an odd number, and within so many s.  Only in
# single precision: in a cloth that folds, this parts two runs no sooner than rounding does, but
# in double precision it would.
_WIDEST = 17
_IMPULSE = 3e-3
# Share of a velocity that the air, and a dashpot, may then take at once.
_BY_AIR = 0.1
_BY_DASHPOTS = 0.5


def integrator_for(scene: Scene) -> type[Integrator]:
    """Return the method of a scene; `auto` is the one that wins wherever it was measured."""
    return INTEGRATORS.get(scene.solver.method, PositionVerlet)


def rounding_heating_rate(scene: Scene) -> float:
    """
    Return how fast rounding in single precision heats a cloth, 1/s; see `HEATING`.

    A position x is rounded by up to δ = ε x / 2 in every substep, against springs that return
    λ m δ²/2 of it as energy.  Of that a share of 0.03 has been measured to come back, on sheets of
    16 × 16 to 128 × 128 with stiffness of 10 kN/m to 10 MN/m.
    """
    elastic, _ = scene.rate_bounds()
    length = scene.sheet.diagonal
    if elastic == 0 or length == 0:
        return 0.0
    rounding = 0.5 * float(np.finfo(np.float32).eps) * length
    power = 0.03 * elastic * rounding**2 / 2 / substep_length(scene)
    return power / (float(np.linalg.norm(scene.gravity)) * length + length**2)


def precision_for(scene: Scene) -> str:
    """
    Return `single` or `double`; for `auto` what the tolerance needs.

    Rounding in single precision decides how a cloth folds, and moves it by a millimetre or two
    in a second (the hanging scene); below that, only double precision is of use.  And a cloth that
    is so stiff and light that rounding would heat it is taken in double precision, whatever is
    asked for.
    """
    precision = scene.solver.precision
    if precision == 'auto':
        precision = 'double' if scene.solver.tolerance < _SINGLE else 'single'
    return 'double' if rounding_heating_rate(scene) > MAX_ROUNDING_HEATING_RATE else precision


def substep_length(scene: Scene) -> float:
    """
    Return the length of the substeps of a scene, s.

    A whole number of them makes a tick: the scene's own, or the least that keeps

    * stability: at most `stability.SAFETY` of the limit;
    * accuracy: at most the step that the method takes for the tolerance;
    * every mode's frequency within 0.1 %, as far as that costs next to nothing.
    """
    method = integrator_for(scene)
    tick = 1 / scene.rate
    if scene.solver.substeps:
        return tick / scene.solver.substeps
    limit = method.stable_step(*scene.rate_bounds())
    particles = scene.sheet.rows * scene.sheet.columns
    longest = min(
        tick,
        stability.SAFETY * limit,
        method.accurate_step(scene),
        max(0.5 * _RESOLVED * limit, particles / _CHEAP, _SHORTEST),
    )
    return tick / math.ceil(tick / longest * (1 - ROUNDING))


def substep_division(scene: Scene, substep: float, speed: float) -> int:
    """
    Return by how much a substep is to be divided for a cloth in fast motion.

    The stability limit is that of a frozen state.  Where particles move by more than a fraction of
    a rest length in a substep, springs turn over within it, and explicit methods at their limit
    pump energy into them, without end where nothing damps.  A number of substeps that the user has
    fixed is left alone.

    Parameters
    ----------
    scene
        What is simulated.
    substep
        Its length in calm motion, s.
    speed
        Of the fastest particle, m/s.

    """
    if scene.solver.substeps:
        return 1
    division = speed * substep / (_TRAVEL * scene.sheet.shortest_spacing)
    # Not finite compares as false.
    return max(math.ceil(division), 1) if division < _FINEST else _FINEST


def dissipation_interval(scene: Scene, substep: float, viscous: float, airspeed: float) -> int:
    """
    Return in how many substeps dissipation acts once, in single precision; an odd number.

    Parameters
    ----------
    scene
        What is simulated.
    substep
        Its length, s.
    viscous
        Bound of the damping by dashpots per unit mass, 1/s.
    airspeed
        Of the fastest particle in the air, m/s.

    """
    if scene.solver.substeps:
        return 1
    dx, dy = scene.sheet.spacing
    air = 0.0
    if scene.has_air:
        pressure = 0.5 * scene.wind.air_density * scene.wind.drag_coefficient * airspeed
        air = pressure * dx * dy / scene.sheet.particle_mass
    interval = min(_IMPULSE, _BY_AIR / max(air, 1e-9), _BY_DASHPOTS / max(viscous, 1e-9))
    # Not finite compares as false.
    spacing = int(interval / substep) if interval < _WIDEST * substep else _WIDEST
    return max(spacing - 1 + spacing % 2, 1)
