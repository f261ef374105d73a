"""How long the substeps are: stable always, accurate as asked, and finer where that is free."""

from __future__ import annotations

import math

from . import stability
from .methods import method_of
from .scene import Scene

# A share of a substep by which a count may be rounded down: a time that is a whole number of
# substeps but for rounding is not given one more.
ROUNDING = 1e-6

# Phase, rad, that the stiffest mode turns in a substep when its frequency is right within 0.1 %:
# that of the explicit methods is (2/h) asin(ω h/2).
_RESOLVED = 0.15
# Particle steps per second that no machine notices, and shortest substep, s, that is taken for
# it: calling the kernels takes some 15 µs, however few the particles.  Small sheets are resolved
# better for them.
_CHEAP = 3e6
_SHORTEST = 2.5e-4

# Position error of a second-order method at the stability limit, as a share of the sheet's
# diagonal: what cloth_tradeoff measures on the scenes of config/, where they are not chaotic.
_ERROR_AT_LIMIT = 2e-4

# Height, m, that even the smallest sheet is taken to fall.
_LEAST_FALL = 0.5
# Share of the shortest rest length that the fastest particle may move in a substep, and the
# finest division of a substep to that end.
_TRAVEL = 0.2
_FINEST = 8
# Substeps from one look at the speed to the next.
LOOK_EVERY = 17
# Dissipation acts once in so many substeps at most, an odd number, and within so many s.  Only in
# single precision: in a cloth that folds, this parts two runs no sooner than rounding does, but
# in double precision it would.
_WIDEST = 17
_IMPULSE = 3e-3
# Share of a velocity that the air, and a dashpot, may then take at once.
_BY_AIR = 0.1
_BY_DASHPOTS = 0.5


def substep_length(scene: Scene, stability_limit: float, *, coarse: bool = False) -> float:
    """
    Return the length of the substeps of a scene, s; a whole number of them makes a tick.

    The number is the scene's own, or the least that keeps three conditions:

    * stability: at most `stability.SAFETY` of the limit;
    * accuracy.  A first-order method is half a substep out of time, and a cloth that falls and
      swings moves at up to sqrt(2 g L), L its diagonal, or with the wind; the product aims at
      the tolerance, and `refinement` sees to cloths that are faster.  Of a second-order method it
      is known by measurement how large its error is at the limit, and that it falls with the
      square of the substep;
    * every mode's frequency within 0.1 %, as far as that costs next to nothing.

    Parameters
    ----------
    scene
        What is simulated.
    stability_limit
        Longest stable substep, s.
    coarse
        True to keep the first condition only.

    """
    tick = 1 / scene.rate
    longest = min(stability.SAFETY * stability_limit, tick)
    if not coarse:
        if scene.solver.substeps:
            return tick / scene.solver.substeps
        particles = scene.sheet.rows * scene.sheet.columns
        resolved = 0.5 * _RESOLVED * stability_limit
        longest = min(
            longest,
            _accurate(scene, stability_limit),
            max(resolved, particles / _CHEAP, _SHORTEST),
        )
    return tick / math.ceil(tick / longest * (1 - ROUNDING))


def _accurate(scene: Scene, stability_limit: float) -> float:
    """Return the substep, s, whose error is about the tolerance."""
    if method_of(scene.solver.method).order > 1:
        at_limit = _ERROR_AT_LIMIT * scene.sheet.diagonal
        if at_limit == 0:
            return math.inf
        return stability_limit * math.sqrt(scene.solver.tolerance / at_limit)
    fall = max(scene.sheet.diagonal, _LEAST_FALL)
    speed = math.sqrt(2 * math.hypot(*scene.gravity) * fall)
    if scene.has_air:
        gust = scene.wind.gust.speed[1] if scene.wind.gust.period > 0 else 0.0
        speed = max(speed, math.hypot(*scene.wind.velocity) + gust)
    return 2 * scene.solver.tolerance / speed if speed > 0 else math.inf


def refinement(scene: Scene, substep: float, speed: float, *, coarse: bool = False) -> int:
    """
    Return by how much a substep is to be divided for a cloth in fast motion.

    For the sake of energy: the stability limit is that of a frozen state.  Where particles move
    by more than a fraction of a rest length in a substep, springs turn over within it, and
    explicit methods pump energy into them, without end where nothing damps.  For the sake of
    accuracy with a first-order method, so that half a substep of motion stays within the
    tolerance.  A number of substeps that the user has fixed is left alone.

    Parameters
    ----------
    scene
        What is simulated.
    substep
        Its length in calm motion, s.
    speed
        Of the fastest particle, m/s.
    coarse
        True to leave accuracy out of it.

    """
    if scene.solver.substeps:
        return 1
    travel = _TRAVEL * scene.sheet.shortest_spacing
    if not coarse and method_of(scene.solver.method).order == 1:
        travel = min(travel, 2 * scene.solver.tolerance)
    division = speed * substep / travel
    # Not finite compares as false.
    return max(math.ceil(division), 1) if division < _FINEST else _FINEST


def dissipation_spacing(scene: Scene, substep: float, viscous: float, airspeed: float) -> int:
    """
    Return in how many substeps dissipation acts once; an odd number.

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
    if scene.solver.substeps or scene.solver.precision == 'double':
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
