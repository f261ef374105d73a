"""
Systems with a closed solution, and the error of each integrator on them.

In the order of the list each adds one thing: a constant force, a spring, damping, many springs,
equilibrium, large angles, air.  The last two solutions are those of the difference equations: what
an integrator makes of an oscillator that its substep does not resolve.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Iterator
from functools import partial

import numpy as np

from ..model import Cloth
from ..model.grid import Array
from ..model.integrators import INTEGRATORS
from ..scene import Scene
from .validation import AnalyticCase, Measurement

_GRAVITY = 9.81  # m/s²
_NO_GRAVITY = (0.0, 0.0, 0.0)
_BOTH_ENDS = ['0,0', '0,-1']
_DOWN = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))  # columns run along -z


def scene(method: str, **changes: object) -> Scene:
    """
    Return a scene in double precision with gravity and structural springs only.

    Parameters
    ----------
    method
        Integrator.
    changes
        Parameters by name, two underscores for each dot.

    """
    bare = {
        'pins': [''],
        'drag': 0.0,
        'gravity': [0.0, 0.0, -_GRAVITY],
        'wind.air_density': 0.0,
        'springs.shear': 0.0,
        'springs.bending': 0.0,
        'solver.precision': 'double',
        'solver.method': method,
    }
    dotted = {name.replace('__', '.'): value for name, value in changes.items()}
    return Scene().with_parameters({**bare, **dotted})


def _row(method: str, particles: int, **changes: object) -> Cloth:
    """Return a row of particles, 1 m long, with the first one pinned unless `changes` differ."""
    row = {'sheet__rows': 1, 'sheet__columns': particles, 'pins': ['0,0']}
    return Cloth(scene(method, **{**row, **changes}))


def _eigenvalue(samples: Iterable[float]) -> complex:
    """
    Return z, Im z ≥ 0, of samples xₙ = Re(c zⁿ).

    They satisfy xₙ₊₁ = 2 Re(z) xₙ − |z|² xₙ₋₁, whose coefficients are fitted.
    """
    x = np.array(list(samples))
    (twice, minus), *_ = np.linalg.lstsq(np.stack([x[1:-1], x[:-2]], 1), x[2:], rcond=None)
    return complex(twice / 2, cmath.sqrt(-minus - twice**2 / 4).real)


def _free_fall(method: str) -> Measurement:
    cloth = Cloth(scene(method, sheet__rows=3, sheet__columns=3, solver__substeps=100))
    height = cloth.positions[..., 2]
    cloth.advance(1.0)
    fall = height - cloth.positions[..., 2]
    # Second-order integrators are exact for a parabola.
    return fall, np.full_like(fall, _GRAVITY / 2), 1e-12


# One mass on a spring, moving along it: linear while it does not reach the other end.
_ELASTIC = 3600.0  # 1/s², stiffness per mass
_MASS = 0.1  # kg
_OFFSET = 1e-3  # m, so small that no substep is divided for its speed


def _oscillator(method: str, **changes: object) -> tuple[Cloth, float]:
    """Return a particle displaced along its spring, and its x at rest, m."""
    cloth = _row(
        method,
        2,
        sheet__mass=2 * _MASS,
        springs__structural=_ELASTIC * _MASS,
        gravity=_NO_GRAVITY,
        **changes,
    )
    positions = cloth.positions.copy()
    rest = float(positions[0, 1, 0])
    positions[0, 1, 0] += _OFFSET
    cloth.positions = positions
    return cloth, rest


def _steps(cloth: Cloth, count: int) -> Iterator[None]:
    """Advance by single substeps."""
    for _ in range(count):
        cloth.advance(cloth.substep)
        yield


def _turn(method: str, **changes: object) -> tuple[complex, float]:
    """Return the factor z of an oscillation in a substep, and the substep, s."""
    cloth, rest = _oscillator(method, **changes)
    return _eigenvalue(cloth.positions[0, 1, 0] - rest for _ in _steps(cloth, 200)), cloth.substep


def _frequency(method: str) -> Measurement:
    z, h = _turn(method)
    # Substeps are chosen for 0.1 %.
    return cmath.phase(z) / h, math.sqrt(_ELASTIC), 1e-3


def _damped(method: str, viscous: float, **changes: object) -> Measurement:
    """Compare the position of a mass that is damped at the rate `viscous`, 1/s."""
    time = 0.2
    cloth, rest = _oscillator(method, solver__substeps=1000, **changes)
    cloth.advance(time)
    omega = math.sqrt(_ELASTIC - viscous**2 / 4)
    exact = math.cos(omega * time) + viscous / 2 / omega * math.sin(omega * time)
    exact *= _OFFSET * math.exp(-viscous * time / 2)
    # A substep of 17 µs at 60 rad/s is a phase of 1e-3, and a 24th of its square 4e-8.
    found = cloth.positions[0, 1, 0] - rest
    return found, exact, 1e-6


def _chain_mode(method: str, mode: int) -> Measurement:
    free, stiffness = 10, 500.0
    cloth = _row(
        method, free + 2, springs__structural=stiffness, gravity=_NO_GRAVITY, pins=_BOTH_ENDS
    )
    shape = np.sin(mode * np.pi * np.arange(free + 2) / (free + 1))
    rest = cloth.positions
    displaced = rest.copy()
    displaced[0, :, 0] += _OFFSET * shape
    cloth.positions = displaced
    steps = _steps(cloth, 400)
    z = _eigenvalue(float((cloth.positions - rest)[0, :, 0] @ shape) for _ in steps)
    rate = math.sqrt(stiffness / cloth.scene.sheet.cell_mass)
    exact = 2 * rate * math.sin(mode * math.pi / 2 / (free + 1))
    # Substeps are chosen for 0.1 %.
    return cmath.phase(z) / cloth.substep, exact, 1e-3


def _sag(method: str) -> Measurement:
    particles, stiffness = 11, 500.0
    cloth = _row(
        method, particles, sheet__orientation=_DOWN, springs__structural=stiffness, drag=20.0
    )
    cloth.advance(4.0)
    found = -np.diff(cloth.positions[0, :, 2]) - 1 / (particles - 1)
    below = (np.arange(particles - 1, 0, -1) - 0.5) * cloth.scene.sheet.cell_mass
    # Drag leaves e⁻⁴⁰ of the oscillation, and the equilibrium does not depend on the substep.
    return found, below * _GRAVITY / stiffness, 1e-10


def _catenary(method: str) -> Measurement:
    links, span, length = 40, 0.8, 1.0
    cloth = _row(
        method, links + 1, springs__structural=1e6, pins=_BOTH_ENDS, drag=8.0, solver__substeps=400
    )
    arc = np.linspace(-length / 2, length / 2, links + 1)
    shape = np.zeros((1, links + 1, 3))
    shape[0, :, 0] = arc * span / length  # from an unstrained V
    shape[0, :, 2] = -(length / 2 - np.abs(arc)) * math.sqrt(1 - (span / length) ** 2)
    cloth.positions = shape
    cloth.advance(4.0)
    # Newton's method for sinh u = u length/span; then a = span/2u.
    u = math.sqrt(6 * (length / span - 1))
    for _ in range(20):
        u -= (math.sinh(u) - u * length / span) / (math.cosh(u) - length / span)
    a = span / 2 / u
    depth = np.sqrt(a**2 + length**2 / 4) - np.sqrt(a**2 + arc**2)
    # A polygon deviates from the curve by 1/links² or 6e-4; the springs stretch by 4e-5.
    return -cloth.positions[0, 1:-1, 2], depth[1:-1], 1e-3


def _pendulum(method: str, degrees: float) -> Measurement:
    length, amplitude = 1.0, math.radians(degrees)
    cloth = _row(method, 2, springs__structural=2e5, solver__substeps=100)
    pivot = cloth.positions[0, 0]
    start = pivot + length * np.array([math.sin(amplitude), 0.0, -math.cos(amplitude)])
    cloth.positions = np.stack([pivot, start])[None]
    # Complete elliptic integral of the first kind by the arithmetic-geometric mean.
    a, b = 1.0, math.cos(amplitude / 2)
    for _ in range(10):
        a, b = (a + b) / 2, math.sqrt(a * b)
    period = 2 * math.pi * math.sqrt(length / _GRAVITY) / a
    passages, before = [], amplitude
    while cloth.time < 1.3 * period:
        time = cloth.time
        cloth.advance(1 / 60)
        arm = cloth.positions[0, 1] - pivot
        after = math.atan2(arm[0], -arm[2])
        if before > 0 >= after:
            passages.append(time + (cloth.time - time) * before / (before - after))
        before = after
    # The spring stretches by up to 3 m g/k = 1.5e-5, and the period by half of that.
    return passages[1] - passages[0], period, 2e-5


def _terminal_drag(method: str) -> Measurement:
    drag = 4.0
    cloth = _row(method, 1, pins=[''], drag=drag, solver__substeps=1)
    cloth.advance(10.0)
    # Drag leaves e⁻⁴⁰ of the difference.
    return -float(cloth.velocities[0, 0, 2]), _GRAVITY / drag, 1e-12


def _fall_in_air(method: str, rate: float, seconds: float) -> tuple[Array, float]:
    """
    Return the speeds of the particles of a flat sheet that falls in air, and its terminal speed.

    Without springs, m/s.  All particles have the same mass per area, and fall alike.  A flat fall
    is unstable: rounding tilts the sheet in time, and less with a wide spacing.
    """
    rows, columns, spacing, density = 4, 5, 10.0, 1.2
    mass = 20.0  # kg, of a cell
    cloth = Cloth(
        scene(
            method,
            sheet__rows=rows,
            sheet__columns=columns,
            sheet__size=[spacing * (columns - 1), spacing * (rows - 1)],
            sheet__mass=mass * (rows - 1) * (columns - 1),
            springs__structural=0.0,
            wind__air_density=density,
            rate=rate,
            solver__substeps=1,
        )
    )
    cloth.advance(seconds)
    terminal = math.sqrt(2 * mass * _GRAVITY / (density * spacing**2))
    return -cloth.velocities[..., 2], terminal


def _terminal_air(method: str) -> Measurement:
    speeds, terminal = _fall_in_air(method, 5.0, 3.6)
    # Each substep, of g h/v = 1.1, leaves a fifth of the difference or less.
    return speeds, np.full_like(speeds, terminal), 1e-12


def _approach(method: str) -> Measurement:
    time = 0.09
    speeds, terminal = _fall_in_air(method, 200.0, time)
    exact = terminal * math.tanh(_GRAVITY * time / terminal)
    # The impulse of the air is of second order in every integrator; g h/v = 0.03 here.
    return speeds, np.full_like(speeds, exact), 1e-4


def _unresolved(method: str, viscous: float) -> Measurement:
    """Compare modulus and phase of the factor of an oscillation in a substep, ω h = 1."""
    rate = math.sqrt(_ELASTIC)
    z, h = _turn(method, rate=rate, solver__substeps=1, springs__damping=viscous * _MASS)
    spectrum = np.linalg.eigvals(INTEGRATORS[method].amplification(h, _ELASTIC, viscous))
    exact = complex(spectrum[np.argmax(spectrum.imag)])
    return np.array(cmath.polar(z)), np.array(cmath.polar(exact)), 1e-9


_ELASTICITY = 'springs.structural'
_DAMPED = 'x = e^(−{0}t/2) (A cos ωt + B sin ωt), ω² = k/m − {0}²/4'
_FACTOR = 'modulus and argument of the eigenvalue of a substep, {}'
_SPEED = '√(2 m g/(ρ C A))'

ANALYTIC_CASES = (
    AnalyticCase('free fall', 'z = ½ g t²', 'm', 'gravity', _free_fall),
    AnalyticCase('oscillator', 'ω = √(k/m)', 'rad/s', _ELASTICITY, _frequency),
    AnalyticCase(
        'oscillator with a dashpot',
        _DAMPED.format('μ') + ', μ = c/m',
        'm',
        'springs.damping',
        partial(_damped, viscous=4.0, springs__damping=4.0 * _MASS),
    ),
    AnalyticCase(
        'oscillator with drag',
        _DAMPED.format('γ'),
        'm',
        'drag',
        partial(_damped, viscous=4.0, drag=4.0),
    ),
    *(
        AnalyticCase(
            f'chain, mode {mode}',
            f'ω = 2 √(k/m) sin({mode}π/22), 10 particles between two pins',
            'rad/s',
            _ELASTICITY,
            partial(_chain_mode, mode=mode),
        )
        for mode in (1, 2, 5, 10)
    ),
    AnalyticCase('hanging chain', 'elongation = weight below / k', 'm', _ELASTICITY, _sag),
    AnalyticCase(
        'catenary', 'z = a cosh(x/a), 2 a sinh(span/2a) = length', 'm', 'gravity', _catenary
    ),
    *(
        AnalyticCase(
            f'stiff pendulum, {degrees}°',
            f'T = 2π √(L/g) / agm(1, cos {degrees // 2}°)',
            's',
            'gravity',
            partial(_pendulum, degrees=degrees),
        )
        for degrees in (10, 60, 120)
    ),
    AnalyticCase('terminal velocity, drag', 'v = g/γ', 'm/s', 'drag', _terminal_drag),
    AnalyticCase(
        'terminal velocity, air', f'v = {_SPEED}', 'm/s', 'wind.air_density', _terminal_air
    ),
    AnalyticCase(
        'fall in air',
        f'v = u tanh(g t/u), u = {_SPEED}',
        'm/s',
        'wind.drag_coefficient',
        _approach,
    ),
    AnalyticCase(
        'numerical frequency',
        _FACTOR.format('ω h = 1'),
        '1, rad',
        _ELASTICITY,
        partial(_unresolved, viscous=0.0),
    ),
    AnalyticCase(
        'numerical damping',
        _FACTOR.format('ω h = 1, μ h = 0.1'),
        '1, rad',
        'springs.damping',
        partial(_unresolved, viscous=6.0),
    ),
)
