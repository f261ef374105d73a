"""
The extremes of every parameter, each with what is expected of it.

    python -m reliability.extremes [--quick]

On top of what is named, every case is watched as a random scene is (`promises`).  A quick run is
not written to docs/reliability.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from cloth_ros import Cloth, Scene

from .promises import Outcome, Watch
from .record import Row, broken, write

_SMALL = {'sheet.rows': 12, 'sheet.columns': 12}
_STILL = {'wind.air_density': 0.0, 'drag': 0.0}
_HOUR, _MINUTE = 3600.0, 60.0


@dataclass(frozen=True)
class Case:
    """
    An extreme.

    Attributes
    ----------
    what, promised
        In words.
    run
        Runs it, watched, and returns whether it came out as promised, and figures.

    """

    what: str
    promised: str
    run: Callable[[Outcome], tuple[bool, str]]

    def row(self) -> Row:
        """Run it and return what came of it."""
        outcome = Outcome()
        try:
            kept, measured = self.run(outcome)
        except Exception as error:
            return broken(self.what, self.promised, error)
        return Row(self.what, self.promised, measured, bool(kept))


def _scene(**changes: object) -> Scene:
    dotted = {name.replace('__', '.'): value for name, value in changes.items()}
    return Scene().with_parameters({**_SMALL, **dotted})


def _watched(cloth: Cloth, outcome: Outcome, ticks: int, seconds: float) -> str:
    """Advance tick by tick, checking all the time; return figures."""
    watch = Watch(cloth, outcome)
    substeps = 0
    for _ in range(ticks):
        cloth.advance(seconds)
        watch.check()
        substeps += cloth.substeps
    rollbacks = cloth.rollbacks.text
    return (
        f'largest strain {cloth.largest_strain():.2g}, {substeps} substeps in '
        f'{ticks * seconds:.3g} s' + (f', repeated: {rollbacks}' if rollbacks else '')
    )


def _some_substeps(cloth: Cloth) -> tuple[int, float]:
    """Return ticks and their length for about 3000 substeps of a stiff scene."""
    return 10, min(1 / 60, 300 * cloth.substep)


def _runs(**changes: object) -> Callable[[Outcome], tuple[bool, str]]:
    """Return a run of a scene that is only watched."""

    def run(outcome: Outcome) -> tuple[bool, str]:
        cloth = Cloth(_scene(**changes))
        return True, _watched(cloth, outcome, *_some_substeps(cloth))

    return run


def _falls_freely(outcome: Outcome) -> tuple[bool, str]:
    none = {f'springs__{name}': 0.0 for name in ('structural', 'shear', 'bending')}
    cloth = Cloth(_scene(**none, wind__air_density=0.0, drag=0.0, solver__precision='double'))
    start = cloth.positions
    _watched(cloth, outcome, 60, 1 / 60)
    fallen = (start - cloth.positions)[1:, :, 2]
    error = float(np.abs(fallen - 9.81 / 2).max())
    return error < 1e-9, f'after 1 s {error:.1g} m from free fall'


def _damped(outcome: Outcome) -> tuple[bool, str]:
    scene = _scene(springs__damping=100.0, gravity=[0.0, 0.0, 0.0], **{'drag': 0.0})
    cloth = Cloth(scene)
    elastic, viscous = scene.rate_bounds()
    ratio = viscous / (2 * math.sqrt(elastic))
    cloth.velocities = np.random.default_rng(0).normal(0, 1, cloth.positions.shape)
    start = cloth.energy()
    figures = _watched(cloth, outcome, 5, 1 / 60)
    return cloth.energy() < start, f'damping ratio up to {ratio:.0f}; {figures}'


def _tick(seconds: float, ticks: int) -> Callable[[Outcome], tuple[bool, str]]:
    def run(outcome: Outcome) -> tuple[bool, str]:
        cloth = Cloth(_scene())
        figures = _watched(cloth, outcome, ticks, seconds)
        return abs(cloth.time - ticks * seconds) < 1e-9 * cloth.time, figures

    return run


def _irregular(outcome: Outcome) -> tuple[bool, str]:
    cloth = Cloth(_scene())
    watch = Watch(cloth, outcome)
    lengths = 10 ** np.random.default_rng(0).uniform(-6, 0, 200)
    for seconds in lengths:
        cloth.advance(float(seconds))
        watch.check()
    return abs(cloth.time - lengths.sum()) < 1e-9, f'{len(lengths)} advances of 1 µs to 1 s'


def _sheet(rows: int, columns: int, pins: list[str]) -> Callable[[Outcome], tuple[bool, str]]:
    def run(outcome: Outcome) -> tuple[bool, str]:
        scene = _scene(sheet__rows=rows, sheet__columns=columns, pins=pins, sphere__radius=0.1)
        cloth = Cloth(scene)
        cloth.wind = (3.0, 2.0, 1.0)
        large = rows * columns > 1e5
        return True, _watched(cloth, outcome, 1 if large else 20, 20 * cloth.substep)

    return run


def _storm(outcome: Outcome) -> tuple[bool, str]:
    cloth = Cloth(_scene(sheet__rows=32, sheet__columns=32))
    watch, fastest = Watch(cloth, outcome), 0.0
    for n in range(20):
        cloth.wind = (0.0, 1e4 * (-1) ** (n // 5), 0.0)
        cloth.advance(min(1 / 60, 200 * cloth.substep))
        watch.check()
        fastest = max(fastest, float(np.linalg.norm(cloth.velocities, axis=-1).max()))
    rollbacks = cloth.rollbacks.text or 'nothing'
    return True, f'fastest particle {fastest:.0f} m/s; repeated: {rollbacks}'


def _sphere(  # type: ignore[no-untyped-def]
    radius: float,
    path: list[tuple[float, ...]],
    tick: float,
    pins: list[str],
    *,
    held: bool = False,
):
    """
    Return a run with a sphere that passes positions, one a tick, and then rests for 20.

    Pins are to hold the sheet in it, where `held`.
    """

    def run(outcome: Outcome) -> tuple[bool, str]:
        scene = _scene(sphere__radius=radius, sphere__position=path[0], pins=pins)
        cloth = Cloth(scene)
        watch, max_penetration = Watch(cloth, outcome), 0.0
        for position in [*path[1:], *[path[-1]] * 20]:
            cloth.move_sphere(position)
            cloth.advance(tick)
            watch.check()
            max_penetration = max(max_penetration, cloth.sphere_depth)
        text = f', held {1e3 * max_penetration:.2g} mm deep by pins' if max_penetration else ''
        return held == (max_penetration > 0), f'largest strain {cloth.largest_strain():.2g}{text}'

    return run


def _appears(outcome: Outcome) -> tuple[bool, str]:
    cloth = Cloth(_scene(sphere__radius=0.3, sphere__position=[0.0, 0.0, 1.0]))
    watch, fastest = Watch(cloth, outcome), 0.0
    grown = None
    for _ in range(60):
        cloth.advance(1 / 60)
        watch.check()
        fastest = max(fastest, float(np.linalg.norm(cloth.velocities, axis=-1).max()))
        if grown is None and cloth.sphere_radius == 0.3:
            grown = cloth.time
    if grown is None:
        return False, f'after a second its radius is {cloth.sphere_radius:.2g} m'
    return fastest < 10, f'fastest particle {fastest:.2g} m/s, grown after {grown:.2g} s'


def _start(change: Callable[[Cloth], np.ndarray]) -> Callable[[Outcome], tuple[bool, str]]:  # type: ignore[type-arg]
    def run(outcome: Outcome) -> tuple[bool, str]:
        cloth = Cloth(_scene(**{'drag': 0.0, 'wind__air_density': 0.0}))
        moved, pinned = change(cloth), cloth.scene.pinned()
        moved[pinned] = cloth.positions[pinned]
        cloth.positions = moved
        return True, _watched(cloth, outcome, 20, 1 / 240)

    return run


def _crumple(cloth: Cloth) -> np.ndarray:  # type: ignore[type-arg]
    return cloth.positions + np.random.default_rng(0).normal(0, 0.3, cloth.positions.shape)


def _long(seconds: float, precision: str, drag: float) -> Callable[[Outcome], tuple[bool, str]]:
    def run(outcome: Outcome) -> tuple[bool, str]:
        cloth = Cloth(_scene(wind__air_density=0.0, drag=drag, solver__precision=precision))
        watch, start = Watch(cloth, outcome), cloth.energy()
        swing = cloth.scene.sheet.mass * 9.81 * cloth.scene.sheet.diagonal
        energies = []
        for _ in range(20):
            cloth.advance(seconds / 20)
            watch.check()
            energies.append(cloth.energy() - start)
        if drag:
            still = float(np.linalg.norm(cloth.velocities, axis=-1).max())
            return still < 5e-3, f'fastest particle {still:.1g} m/s at the end'
        drift = max(abs(each) for each in energies) / swing
        rollbacks = cloth.rollbacks.text
        figures = f'energy within {100 * drift:.2g} % of that of its fall'
        return drift < 0.05, figures + (f'; repeated: {rollbacks}' if rollbacks else '')

    return run


def cases(*, quick: bool) -> Iterator[Case]:
    """Yield all cases; the quick ones leave out what takes minutes."""
    safe = 'finite, within its energy, pins unmoved'
    yield Case('stiffness 0', 'particles fall freely, pins hold', _falls_freely)
    for k in (1e-3, 1e4, 1e8):
        stiffness = {f'springs__{name}': k for name in ('structural', 'shear', 'bending')}
        yield Case(f'stiffness {k:g} N/m', safe, _runs(**stiffness))
    for name in ('structural', 'shear', 'bending'):
        others = {f'springs__{other}': 1.0 for other in ('structural', 'shear', 'bending')}
        ratio = {**others, f'springs__{name}': 1e6}
        yield Case(f'{name} 1e6 times as stiff as the others', safe, _runs(**ratio))
    for mass in (1e-9, 1e3):
        run = _runs(sheet__mass=144 * mass)
        yield Case(f'particles of {mass:g} kg', safe, run)
    yield Case('damping far past critical', 'energy falls', _damped)
    for seconds, ticks in ((1e-6, 200), (60.0, 1)):
        yield Case(f'ticks of {seconds:g} s', 'simulated as any', _tick(seconds, ticks))
    yield Case('irregular ticks', 'time adds up', _irregular)
    shapes = [(1, 1), (1, 40), (40, 1), (2, 2), (3, 200)]
    for rows, columns in shapes if quick else [*shapes, (1024, 1024)]:
        yield Case(f'{rows} × {columns} particles', safe, _sheet(rows, columns, ['0,0']))
    yield Case('no pins', safe, _sheet(12, 12, ['']))
    yield Case('all pinned', safe, _sheet(12, 12, [':,:']))
    yield Case('wind of 10 km/s, reversed each 5 ticks', safe, _storm)
    for gravity in (0.0, 9.81, -981.0):
        run = _runs(gravity=[0.0, 0.0, gravity])
        yield Case(f'gravity {gravity:g} m/s² upwards', safe, run)
    above, below = (0.0, 0.05, 2.0), (0.0, 0.05, 0.2)
    dry = 'triangles at most 0.1 mm deep (1 % of a radius below 1 cm)'
    corners = ['0,0', '0,-1']
    for radius in (1e-4, 0.01, 1.0, 100.0):
        path = [(0.0, 0.05, 1.3 + radius), (0.0, 0.05, 0.9 + radius)]
        held = radius > 10  # its flank reaches the pinned corners
        run = _sphere(radius, path, 1 / 60, corners, held=held)
        yield Case(f'sphere of {radius:g} m', dry, run)
    yield Case('sphere that appears in the sheet', 'grows, throws nothing', _appears)
    yield Case(
        'sphere teleported across the sheet in a tick of 1 ms', dry,
        _sphere(0.1, [above, below, above, below], 1e-3, corners),
    )  # fmt: skip
    yield Case('sphere at 1 km/s', dry, _sphere(0.05, [above, below], 1.8e-3, corners))
    pressed = [(0.0, -0.5, 1.5), (0.0, -0.5, 1.02), (0.0, -0.45, 0.98)]
    yield Case(
        'sphere pressed on a pinned edge',
        'says how deep',
        _sphere(0.1, pressed, 1 / 60, ['0,:'], held=True),
    )
    yield Case('crumpled start', safe, _start(_crumple))
    yield Case('start upside down', safe, _start(lambda cloth: [0, 0, 2] - cloth.positions))
    on_top = _start(lambda cloth: np.full_like(cloth.positions, 1.0))
    yield Case('all particles in one place', safe, on_top)
    span, name = (2 * _MINUTE, 'two minutes') if quick else (_HOUR, 'an hour')
    for precision in ('single', 'double'):
        what = f'{name} of swinging, nothing damped, {precision}'
        yield Case(what, 'energy neither creeps up nor dies', _long(span, precision, 0.0))
    yield Case(f'{name} with drag', 'comes to rest', _long(span, 'single', 0.5))


def main() -> int:
    """Run, print and write; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--quick', action='store_true', help='leave out what takes minutes')
    arguments = parser.parse_args()
    rows = []
    for case in cases(quick=arguments.quick):
        start = time.monotonic()
        rows.append(case.row())
        print(f'{time.monotonic() - start:5.1f} s  {case.what}: {rows[-1].measured}', flush=True)
    summary = (
        f'{len(rows)} extremes of stiffness, mass, tick, grid, pins, damping, wind, gravity, '
        'sphere, start and duration'
    )
    title, full = 'Extremes of the model', not arguments.quick
    return 0 if write('extremes', 'make extremes', title, summary, rows, full=full) else 1


if __name__ == '__main__':
    sys.exit(main())
