"""Extremes of parameters, grids, ticks, spheres and initial states."""

import math
from collections import Counter

import numpy as np
import pytest
from reliability.invariants import Invariants

from cloth_ros import Cloth, Scene
from cloth_ros.model.stability import rate_bounds

FAMILIES = ('springs.structural', 'springs.shear', 'springs.bending')


def make(changes: dict) -> Cloth:
    return Cloth(Scene(sheet={'rows': 12, 'columns': 12}).with_parameters(changes))


def watch(cloth: Cloth, seconds, before=lambda n: None) -> str:
    """Advance by some durations, checking the invariants each time; return what was measured."""
    invariants, substeps, fastest, deepest = Invariants(cloth, Counter()), 0, 0.0, 0.0
    for n, duration in enumerate(seconds):
        before(n)
        cloth.advance(float(duration))
        invariants.check()
        substeps += cloth.substeps
        fastest = max(fastest, float(np.linalg.norm(cloth.velocities, axis=-1).max()))
        deepest = max(deepest, cloth.sphere_depth)
    assert cloth.time == pytest.approx(sum(seconds), rel=1e-9)
    text = f'{substeps} substeps, largest stretch {cloth.strain().stretch:.2g}, fastest particle'
    text += f' {fastest:.2g} m/s' + (f', {1e3 * deepest:.2g} mm deep by pins' if deepest else '')
    return text + (f'; rolled back: {rollbacks}' if (rollbacks := cloth.rollbacks.text) else '')


SCENES = [
    *(dict.fromkeys(FAMILIES, stiffness) for stiffness in (1e-3, 1e4, 1e8)),
    *({**dict.fromkeys(FAMILIES, 1.0), stiff: 1e6} for stiff in FAMILIES),
    *({'sheet.mass': mass} for mass in (144e-9, 144e3, 1e9)),
    *({'gravity': [0.0, 0.0, z]} for z in (0.0, 9.81, -981.0)),
    *({'pins': pins} for pins in ([''], [':,:'])),
    {'gravity': [1e4, 1e4, -1e4]},
    {'sheet.size': [1e-3, 1.0], 'sheet.columns': 1024, 'sheet.rows': 2},
    {'sheet.size': [1e3, 1e3]},
    {'sheet.orientation': [1e6, -1e6, 1e6, 0.0]},
    {'sheet.position': [1e6, -1e6, 1e6]},
    {'wind.gust.seed': 2**53, 'wind.gust.period': 1e-3, 'wind.gust.duration': 1e-3},
    {'wind.gust.period': 1e6, 'wind.gust.duration': 1e6},
    {'wind.velocity': [1e4, -1e4, 1e4]},
    {'drag': 1e6},
    {'sphere.radius': 1e3, 'sphere.position': [0.0, 0.0, -1002.0]},
    {'sphere.radius': 1e-4, 'sphere.friction': 10.0},
    {'rate': 1000.0},
    {'solver.tolerance': 1e-6},
    {'solver.tolerance': 1.0, 'solver.max_tick': 10.0},
    {'solver.threads': 64},
    {'solver.substeps': 1_000_000},
]


@pytest.mark.parametrize('changes', SCENES, ids=str)
def test_parameters(changes, measured):
    """Ends of the ranges of parameters, and beyond any use: finite, energy explained."""
    cloth = make(changes)
    measured(watch(cloth, 10 * [min(1 / 60, 300 * cloth.substep)]))


GRIDS = [(1, 1), (1, 40), (40, 1), (2, 2), (3, 200)]


@pytest.mark.parametrize('grid', [*GRIDS, pytest.param((1024, 1024), marks=pytest.mark.long)])
def test_grids(grid, measured):
    """Grids of one particle to the largest, with wind and sphere: finite, energy explained."""
    sheet = {'sheet.rows': grid[0], 'sheet.columns': grid[1]}
    cloth = make({**sheet, 'pins': ['0,0'], 'sphere.radius': 0.1})
    cloth.wind = (3.0, 2.0, 1.0)
    measured(watch(cloth, (1 if grid[0] == 1024 else 20) * [20 * cloth.substep]))


def test_no_springs(measured):
    """Stiffness 0: particles fall freely, to rounding; pins hold."""
    none = dict.fromkeys(FAMILIES, 0.0)
    cloth = make({**none, 'wind.air_density': 0.0, 'drag': 0.0, 'solver.precision': 'double'})
    start = cloth.positions
    watch(cloth, 60 * [1 / 60])
    error = float(np.abs((start - cloth.positions)[1:, :, 2] - 9.81 / 2).max())
    measured(f'after 1 s {error:.1g} m from free fall')
    assert error < 1e-9


def test_damping_beyond_critical(measured):
    """Dashpots far beyond critical damping: energy falls."""
    cloth = make({'springs.damping': 100.0, 'gravity': [0.0, 0.0, 0.0], 'drag': 0.0})
    elastic, viscous = rate_bounds(cloth.scene)
    cloth.velocities = np.random.default_rng(0).normal(0, 1, cloth.positions.shape)
    start = cloth.energy()
    text = watch(cloth, 2 * [1 / 60])
    measured(f'damping ratio up to {viscous / (2 * math.sqrt(elastic)):.0f}; {text}')
    assert cloth.energy() < start


TICKS = {'1 µs': 200 * [1e-6], '60 s': [60.0], '1 µs to 1 s': 10 ** np.linspace(-6, 0, 100)}


@pytest.mark.parametrize('ticks', TICKS)
def test_ticks(ticks, measured):
    """Very short, very long and irregular ticks: finite, energy explained, and time adds up."""
    measured(watch(make({}), TICKS[ticks]))


def test_wind_of_10_km_per_s(measured):
    """Wind of 10 km/s that turns round every 5 ticks: finite, energy explained."""
    cloth = make({'sheet.rows': 32, 'sheet.columns': 32})

    def blow(n: int) -> None:
        cloth.wind = (0.0, 1e4 * (-1) ** (n // 5), 0.0)

    measured(watch(cloth, 20 * [min(1 / 60, 200 * cloth.substep)], blow))


ABOVE, BELOW, CORNERS = (0.0, 0.05, 2.0), (0.0, 0.05, 0.2), ['0,0', '0,-1']
PRESSED = [(0.0, -0.5, 1.5), (0.0, -0.5, 1.02), (0.0, -0.45, 0.98)]
SPHERES = {
    **{
        f'{r:g} m': (r, [(0.0, 0.05, 1.3 + r), (0.0, 0.05, 0.9 + r)], 1 / 60, CORNERS)
        for r in (1e-4, 0.01, 1.0, 100.0)
    },
    'teleported in 1 ms': (0.1, [ABOVE, BELOW, ABOVE, BELOW], 1e-3, CORNERS),
    '1 km/s': (0.05, [ABOVE, BELOW], 1.8e-3, CORNERS),
    'pressed on a pinned edge': (0.1, PRESSED, 1 / 60, ['0,:']),
}


@pytest.mark.parametrize('name', SPHERES)
def test_spheres(name, measured):
    """
    Spheres of extreme size and speed, which then rest: at most 0.1 mm deep (1 % of a radius below
    1 cm), unless pins hold the sheet in them, as reported.
    """
    radius, (start, *path), tick, pins = SPHERES[name]
    cloth = make({'sphere.radius': radius, 'sphere.position': list(start), 'pins': pins})
    deepest = 0.0

    def move(n: int) -> None:
        nonlocal deepest
        deepest = max(deepest, cloth.sphere_depth)
        cloth.move_sphere(path[min(n, len(path) - 1)])

    measured(watch(cloth, (len(path) + 20) * [tick], move))
    # The flank of the largest one reaches the pinned corners.
    held = radius == 100.0 or pins == ['0,:']
    assert (max(deepest, cloth.sphere_depth) > 0) == held


def test_sphere_that_appears_in_the_sheet(measured):
    """A sphere that appears in the sheet: grows within a second, and throws nothing."""
    cloth = make({'sphere.radius': 0.3, 'sphere.position': [0.0, 0.0, 1.0]})
    speeds = []
    note = lambda _: speeds.append(np.linalg.norm(cloth.velocities, axis=-1).max())  # noqa: E731
    measured(watch(cloth, 60 * [1 / 60], note))
    assert cloth.sphere_radius == 0.3
    assert max(speeds) < 10


STARTS = {
    'crumpled': lambda p: p + np.random.default_rng(0).normal(0, 0.3, p.shape),
    'upside down': lambda p: [0, 0, 2] - p,
    'all in one place': lambda p: np.full_like(p, 1.0),
}


@pytest.mark.parametrize('start', STARTS)
def test_initial_states(start, measured):
    """Initial states far from rest, nothing damped: finite, energy explained."""
    cloth = make({'drag': 0.0, 'wind.air_density': 0.0})
    pinned, positions = cloth.scene.pinned()[..., None], cloth.positions
    cloth.positions = np.where(pinned, positions, STARTS[start](positions))
    measured(watch(cloth, 20 * [1 / 240]))


@pytest.mark.parametrize(
    ('precision', 'drag'), [('single', 0.0), ('double', 0.0), ('single', 0.5)]
)
def test_durations(precision, drag, long, measured):
    """An hour: without damping energy stays within 5 % of the fall; with drag it comes to rest."""
    seconds = 3600.0 if long else 120.0
    cloth = make({'wind.air_density': 0.0, 'drag': drag, 'solver.precision': precision})
    start, energies = cloth.energy(), []
    swing = cloth.scene.sheet.mass * 9.81 * cloth.scene.sheet.diagonal
    text = watch(cloth, 20 * [seconds / 20], lambda _: energies.append(cloth.energy() - start))
    speed = float(np.linalg.norm(cloth.velocities, axis=-1).max())
    drift = max(map(abs, energies)) / swing
    if drag:
        measured(f'fastest particle {speed:.1g} m/s at the end of {seconds:.0f} s; {text}')
        assert speed < 5e-3
    else:
        measured(f'energy within {100 * drift:.2g} % of the fall in {seconds:.0f} s; {text}')
        assert drift < 0.05
