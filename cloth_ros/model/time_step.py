"""
Choice of integrator and substep length of a scene.

A substep is always stable, as accurate as the tolerance asks, shorter where that costs nothing,
and divided in fast motion.
"""

from __future__ import annotations

import math

from ..scene import Scene
from ..scene.parameter import PARAMETERS, invalid_value_error
from . import stability
from .forces.aerodynamics import coefficient_of_flat_sheet
from .integrators import INTEGRATORS, Integrator
from .integrators.dashpot_stages import REACH
from .integrators.position_verlet import PositionVerlet

# Share of a substep by which a count may be rounded down: a duration that is a whole number of
# substeps but for rounding needs no further one.
ROUNDING = 1e-6

# Phase, rad, of the stiffest mode in a substep at which its frequency is right within 0.1 %: that
# of the explicit integrators is (2/h) asin(ω h/2).
_RESOLVED = 0.15
# Particle steps per second that cost next to nothing on any machine, and the shortest substep, s,
# chosen for that reason.  Small sheets are resolved better with them.
_CHEAP = 3e6
_SHORTEST = 2.5e-4
# Substeps in a tick: several minutes of wall-clock time on any machine.
_MAX_SUBSTEPS = 1e8

# Length of the substeps of a sheet that hangs or lies, as a share of the limit of every state.
_USUAL = 1.05

# Share of the shortest rest length that the fastest particle may move in a substep, and the
# finest division of a substep to that end.
_TRAVEL = 0.2
_FINEST = 8
# Substeps from one check of the speed to the next, and from one measurement of the energy to the
# next, at most.
CHECK_INTERVAL = 17
BATCH = 5 * CHECK_INTERVAL
# Dissipation acts once in so many substeps at most, an odd number, and within so many s.  Only in
# single precision: in a cloth that folds, this separates two runs no sooner than rounding does,
# but in double precision it would.
_MAX_INTERVAL = 17
_IMPULSE = 3e-3
# Share of a velocity that the air, and drag, may then take at once.
_BY_AIR = 0.1
_BY_DRAG = 0.05


def integrator_for(scene: Scene) -> type[Integrator]:
    """Return the integrator of a scene; `auto` is the best one of every measured scene."""
    return INTEGRATORS.get(scene.solver.method, PositionVerlet)


def substep_length(scene: Scene) -> float:
    """
    Return the length of the substeps of a scene, s.

    A whole number of them makes a tick: the scene's own, or the least that keeps

    * stability: at most `stability.SAFETY` of the limit;
    * accuracy: at most the step that the integrator predicts for the tolerance;
    * every mode's frequency within 0.1 %, as far as that costs next to nothing.
    """
    if scene.solver.substeps:
        return 1 / scene.rate / scene.solver.substeps
    integrator = integrator_for(scene)
    limit = integrator.stable_step(*stability.rate_bounds(scene))
    longest = min(stability.SAFETY * limit, accurate_substep(scene))
    return whole_substep(scene, longest)


def part(count: int, most: int) -> int:
    """Return the length of the first of nearly equal parts of a count, none above `most`."""
    return math.ceil(count / math.ceil(count / most))


def whole_substep(scene: Scene, longest: float) -> float:
    """Return the longest substep, s, up to `longest`, of which a whole number makes a tick."""
    tick = 1 / scene.rate
    return tick / max(math.ceil(tick / longest * (1 - ROUNDING)), 1)


def accurate_substep(scene: Scene) -> float:
    """Return the longest substep, s, that accuracy allows; see `substep_length`."""
    integrator = integrator_for(scene)
    limit = integrator.stable_step(*stability.rate_bounds(scene))
    particles = scene.sheet.rows * scene.sheet.columns
    resolved = max(0.5 * _RESOLVED * limit, particles / _CHEAP, _SHORTEST)
    return min(integrator.accurate_step(scene), resolved)


def usual_substep(scene: Scene) -> float:
    """Return the length, s, that substeps of a scene usually have, to predict their cost."""
    if not adapts_to_state(scene):
        return substep_length(scene)
    longest = min(_USUAL * stability_limit(scene), accurate_substep(scene))
    return whole_substep(scene, longest)


def adapts_to_state(scene: Scene) -> bool:
    """Return whether substeps follow the present state: not if fixed, or without springs."""
    return not scene.solver.substeps and math.isfinite(stability_limit(scene))


def substep_of_travel(scene: Scene, speed: float) -> float:
    """Return the longest substep, s, that is not divided for a cloth of this speed, m/s."""
    # Inf at rest, and NaN where the speed is.
    return _TRAVEL * scene.sheet.shortest_spacing / max(speed, 1e-30)


def substep_division(scene: Scene, substep: float, speed: float) -> int:
    """
    Return the divisor of a substep for a cloth in fast motion.

    The stability limit is that of a frozen state.  Where particles move by more than a fraction of
    a rest length in a substep, springs turn over within it, and explicit integrators at their
    limit add energy, without bound where nothing damps.  A number of substeps that the user has
    fixed is not divided.

    Parameters
    ----------
    scene
        Parameters.
    substep
        Length in slow motion, s.
    speed
        Of the fastest particle, m/s.

    """
    if scene.solver.substeps:
        return 1
    division = speed * substep / (_TRAVEL * scene.sheet.shortest_spacing)
    # False where not finite.
    return max(math.ceil(division), 1) if division < _FINEST else _FINEST


def dissipation_interval(scene: Scene, substep: float, viscous: float, airspeed: float) -> int:
    """
    Return in how many substeps dissipation acts once, in single precision; an odd number.

    Parameters
    ----------
    scene
        Parameters.
    substep
        Length, s.
    viscous
        Bound of the damping by dashpots per unit mass, 1/s.
    airspeed
        Of the fastest particle relative to the air, m/s.

    """
    air = coefficient_of_flat_sheet(scene) * airspeed
    seconds = min(
        _IMPULSE,
        _BY_AIR / max(air, 1e-9),
        _BY_DRAG / max(scene.drag, 1e-9),
        REACH / max(viscous, 1e-9),
    )
    # False where not finite.
    interval = int(seconds / substep) if seconds < _MAX_INTERVAL * substep else _MAX_INTERVAL
    return max(interval - 1 + interval % 2, 1)


def stability_limit(scene: Scene) -> float:
    """Return the longest stable substep, s, in every state of the cloth; inf without springs."""
    return integrator_for(scene).stable_step(*stability.rate_bounds(scene))


def dashpots_limit(scene: Scene) -> bool:
    """Return whether the dashpots limit the stable substep, and not the springs."""
    elastic, viscous = stability.rate_bounds(scene)
    stable_step = integrator_for(scene).stable_step
    return stable_step(0.0, viscous) < stable_step(elastic, 0.0)


def check_time_step(scene: Scene) -> None:
    """
    Refuse a scene whose substeps would be unstable, or too many to compute.

    Raises
    ------
    ValueError
        Names the parameter, its value, the allowed range and a remedy.

    """
    limit = stability_limit(scene)
    count = 1 / (scene.rate * substep_length(scene))
    if count > _MAX_SUBSTEPS:
        name = 'springs.damping' if dashpots_limit(scene) else 'springs.structural'
        if limit * scene.rate * _MAX_SUBSTEPS > 2:
            name = 'solver.tolerance'
        raise invalid_value_error(
            name,
            scene.flat()[name],
            f'such that {_MAX_SUBSTEPS:g} substeps a tick are enough (it would take {count:.2g})',
            _fewer_substeps(scene, accuracy=name == 'solver.tolerance'),
        )
    if scene.solver.substeps:
        step = 1 / (scene.rate * scene.solver.substeps)
        if step > stability.SAFETY * limit:
            least = math.ceil(1 / (scene.rate * stability.SAFETY * limit))
            least += 1 / (scene.rate * least) > stability.SAFETY * limit  # by rounding
            raise invalid_value_error(
                'solver.substeps',
                scene.solver.substeps,
                f'0 or at least {least} for a stable step at {scene.rate:g} Hz',
                'write 0, or soften the springs',
            )


def _fewer_substeps(scene: Scene, *, accuracy: bool) -> str:
    """Return what to write so that a tick of a scene needs fewer substeps: a value that does."""
    name = 'solver.tolerance' if accuracy else 'sheet.mass'
    value, most = scene.flat()[name], PARAMETERS[name].bounds[1]
    while value < most:
        value = min(float(f'{10 * value:.3g}'), most)
        changed = scene.with_parameters({name: value})
        if changed.rate * substep_length(changed) * _MAX_SUBSTEPS >= 1.01:
            return f'write {value}' if accuracy else f'write {name}: {value}, or lower springs.*'
    return 'raise it' if accuracy else 'lower springs.*, or raise sheet.mass'
