"""
Choice of single or double precision: single where it resolves every effect of a scene.

Single precision rounds a number x by up to half a unit in its last place, which is at most u |x|
with u = 2⁻²⁴, and at most 3/8 u X in the mean over 0 < x < X.  A substep of length h adds a small
increment to a velocity or a position.  While increments are equal, all are rounded alike: the
errors add up, and an increment below half a unit in the last place is lost.  The loss, as a share
of the effect, is at most

* gravity g, in a fall from rest to the speed V: 3/8 u V / g h.  With air, which acts in one of n
  substeps, 1 + 3/n times that: it rounds velocities in three more operations.
* drag at the rate γ, in one of n substeps: 3/2 u / (γ n h).  The factor e^(−γ n h) is rounded by
  u/2, because it is near 1, and its product with the velocity by u.
* wind of speed w on a cloth at rest, which it accelerates by κ w², in one of n substeps:
  2 u / (κ w n h).  Velocities relative to the air are rounded as w is, in several operations;
  1.1 u was measured.
* motion at constant speed v, as of a steady fall in air or with drag: q u D / v h with D the
  sheet's diagonal, in the mean over its positions.  With pins these are up to D from the origin,
  q = 3/8; the origin follows a sheet without, at distances up to 2 D, and q = 1.

Springs and the dashpots along them need no such bound.  Positions rounded by u X change the
velocities of a moving cloth by about u X / h near the stability limit, and at random: by much more
than a unit in the last place of a velocity, but in no preferred direction.  This heats the cloth,
see `rounding_heating_rate`, and also makes the losses above smaller than their bounds, unless the
sheet is flat.  Contact of particles is computed in the precision of the sheet: what it adds to a
velocity is no smaller than the approach that it stops.

V is the speed of a fall by the sheet's diagonal, or of the wind if that is greater.  The loss of
gravity of a cloth that moves at a constant speed V is up to 8/3 of the above, and that of a faster
one is greater in proportion.
"""

from __future__ import annotations

import math

import numpy as np

from ..scene import Scene
from . import stability
from .forces.aerodynamics import coefficient_of_flat_sheet
from .integrators.integrator import dissipation_schedule
from .time_step import CHECK_INTERVAL, dissipation_interval, substep_division, substep_length

# Tolerance, m, that single precision is good for.
_TOLERANCE = 1e-3
# Share of an effect that may be lost in single precision.
MAX_LOSS = 1e-3
# Heating by rounding, 1/s, that is accepted in single precision: the share of the energy of a
# fall by the sheet's own length (or of a speed of that length per second) added per second.
MAX_ROUNDING_HEATING_RATE = 0.05

# u: largest relative error of rounding to nearest.
_ROUNDING = 0.5 * float(np.finfo(np.float32).eps)
# Largest mean error, as a multiple of u X, of numbers from 0 to X.
_MEAN = 3 / 8
# q: largest mean error of positions, in u D, of a sheet with pins and of a free one.
_MEAN_PINNED, _MEAN_FREE = _MEAN, 1.0


def _gravity(scene: Scene) -> float:
    return float(np.linalg.norm(scene.gravity))


def _length(scene: Scene) -> float:
    return scene.sheet.diagonal or 1.0


def _wind_speed(scene: Scene) -> float:
    """Return the speed, m/s, of the wind of a scene, or of its gusts if there is no other."""
    wind = scene.wind
    if not scene.has_air:
        return 0.0
    gusts = wind.gust.speed[1] if wind.gust.period > 0 else 0.0
    return float(np.linalg.norm(wind.velocity)) or gusts


def fall_speed(scene: Scene) -> float:
    """Return the speed, m/s, of a fall by the sheet's diagonal without resistance."""
    return math.sqrt(2 * _gravity(scene) * _length(scene))


def terminal_speed(scene: Scene) -> float:
    """Return the speed, m/s, of a steady fall of the flat sheet with drag and air; inf: none."""
    gravity = _gravity(scene)
    root = math.sqrt(scene.drag**2 + 4 * coefficient_of_flat_sheet(scene) * gravity)
    return 2 * gravity / (scene.drag + root) if scene.drag + root > 0 else math.inf


def rounding_losses(scene: Scene) -> dict[str, float]:
    """
    Return bounds of the share of each slow effect that rounding in single precision takes.

    Returns
    -------
    dict of str to float
        By name, the effects that the scene has; formulas above.

    """
    gravity, wind, fall = _gravity(scene), _wind_speed(scene), fall_speed(scene)
    speed = max(fall, wind)
    substep = substep_length(scene)
    h = substep / substep_division(scene, substep, speed)
    # Mean number n of substeps for which dissipation acts once.
    _, viscous = stability.rate_bounds(scene)
    interval = dissipation_interval(scene, h, viscous, speed + wind)
    count = min(CHECK_INTERVAL, max(round(1 / (scene.rate * substep)), 1))
    n = count / sum(weight > 0 for _, weight in dissipation_schedule(count, interval))
    losses = {}
    if gravity > 0:
        operations = 1 + 3 / n if scene.has_air else 1.0
        losses['gravity'] = _MEAN * _ROUNDING * operations * speed / (gravity * h)
    if scene.drag > 0:
        losses['drag'] = 1.5 * _ROUNDING / (scene.drag * n * h)
    if wind > 0:
        losses['wind'] = 2 * _ROUNDING / (coefficient_of_flat_sheet(scene) * wind * n * h)
    steady = terminal_speed(scene)
    if 0 < steady < fall:
        mean = _MEAN_PINNED if scene.pinned().any() else _MEAN_FREE
        losses['steady motion'] = mean * _ROUNDING * _length(scene) / (steady * h)
    return losses


def rounding_heating_rate(scene: Scene) -> float:
    """
    Return how fast rounding in single precision heats a cloth, 1/s.

    A position x is rounded by up to δ = ε x / 2 in every substep; the springs then hold an energy
    of up to λ m δ²/2.  A share of 0.03 of that was measured as heating, on sheets of 16 × 16 to
    128 × 128 with a stiffness of 10 kN/m to 10 MN/m.  See `MAX_ROUNDING_HEATING_RATE`.
    """
    elastic, _ = stability.rate_bounds(scene)
    length = scene.sheet.diagonal
    if elastic == 0 or length == 0:
        return 0.0
    rounding = _ROUNDING * length
    power = 0.03 * elastic * rounding**2 / 2 / substep_length(scene)
    return power / (_gravity(scene) * length + length**2)


def reason_for_double(scene: Scene) -> str:
    """
    Return why a scene is simulated in double precision; empty if it is not.

    Rounding in single precision decides how a cloth folds, and moves it by a millimetre or two
    in a second (the hanging scene); tolerances below that need double precision.
    """
    solver = scene.solver
    if solver.precision == 'double':
        return 'as requested'
    if solver.precision == 'auto' and solver.tolerance < _TOLERANCE:
        return f'for a tolerance below {1e3 * _TOLERANCE:g} mm'
    losses = rounding_losses(scene)
    worst = max(losses, key=losses.__getitem__, default='')
    if worst and losses[worst] > MAX_LOSS:
        share = 100 * min(losses[worst], 1.0)
        return f'because single precision would lose up to {share:.3g} % of the {worst}'
    if rounding_heating_rate(scene) > MAX_ROUNDING_HEATING_RATE:
        return 'because rounding in single precision would heat the cloth'
    return ''


def precision_for(scene: Scene) -> str:
    """Return `single` or `double`: double if requested, or where single is not good enough."""
    return 'double' if reason_for_double(scene) else 'single'
