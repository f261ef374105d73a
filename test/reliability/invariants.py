"""What holds for every cloth after every advance, whatever its scene, state and inputs."""

from __future__ import annotations

import math
import time
from collections import Counter
from functools import partial
from typing import Any

import numpy as np
from builders import momentum
from geometry import triangles
from reliability.random_scenes import Run

from cloth_ros import Cloth, Energy, Scene
from cloth_ros.model.contact.continuous_collision import max_penetration
from cloth_ros.model.energy_monitor import EnergyMonitor
from cloth_ros.model.precision import precision_for
from cloth_ros.model.stability import rate_bounds

# Tolerated excess of energy, as a share of the energy that is converted.
ENERGY = 0.05
# Tolerated penetration: m, as a share of the radius, and for positions in single precision as a
# share of their size.
DEPTH, DEPTH_SHARE, ROUNDING = 1e-4, 1e-2, 1e-6


class CountingMonitor(EnergyMonitor):
    """An energy monitor that counts batches, and those whose work is unknown."""

    def __init__(self, scene: Scene, dtype: type, *, totals: Counter[str]) -> None:
        super().__init__(scene, dtype)
        self._totals = totals

    def accepts(self, state: Any, work: float, *, touched: bool = False) -> bool:
        """Count a batch, and judge it."""
        self._totals['batches'] += 1
        self._totals['unknown work'] += work == math.inf
        return super().accepts(state, work, touched=touched)


def corners(rows: int, columns: int) -> np.ndarray:
    """Return the particles of all triangles, both diagonals; of segments where there are none."""
    grid = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    if min(rows, columns) > 1:
        grid = np.repeat(grid[..., None], 3, axis=-1)
        return np.ascontiguousarray(triangles(grid, both_diagonals=True)[..., 0])
    line = grid.ravel()
    ends = (line[:-1], line[1:], line[1:]) if len(line) > 1 else (line, line, line)
    return np.stack(ends, axis=1)


class Invariants:
    """Checks a cloth after each advance; adds counts and the largest values to `totals`."""

    def __init__(self, cloth: Cloth, totals: Counter[str]) -> None:
        self._cloth, self._totals = cloth, totals
        self._triangles = corners(cloth.scene.sheet.rows, cloth.scene.sheet.columns)
        self.begin()

    def begin(self) -> None:
        """Start from the present state: it, or the scene, was set from outside."""
        cloth, scene = self._cloth, self._cloth.scene
        energy = cloth.energy_by_kind()
        self._start, self._motion = energy.total - cloth.work, energy.motion
        self._unknown_work, self._tolerance = False, ENERGY
        if scene.solver.substeps:
            # Position Verlet takes the energy E of an oscillator to E / (1 − φ) at most,
            # φ = h² λ / 4: φ more of the energy in motion then.
            step = 1 / (scene.rate * scene.solver.substeps)
            self._tolerance = max(ENERGY, 0.25 * step**2 * rate_bounds(scene)[0])
        self._internal = self._internal_energy(energy)
        self._pinned = scene.pinned()
        self._pins = cloth.positions[self._pinned]
        self._held = self._pinned.ravel()[self._triangles].any(axis=1)
        self._free = not (self._pinned.any() or scene.sphere.radius > 0 or scene.has_air)

    def check(self, *, unknown_work: bool = False) -> None:
        """Check everything; since the last check, the work of the sphere may be unknown."""
        cloth = self._cloth
        self._unknown_work |= unknown_work
        positions, velocities = cloth.positions, cloth.velocities
        assert np.isfinite(positions).all(), 'not finite'
        assert np.isfinite(velocities).all(), 'not finite'
        assert np.array_equal(positions[self._pinned], self._pins), 'a pin has moved'
        assert not velocities[self._pinned].any(), 'a pin has a velocity'
        self._check_energy()
        if cloth.sphere_radius > 0:
            self._check_depth(positions)
        self._totals['advances'] += 1

    def _note(self, name: str, value: float) -> None:
        self._totals[name] = max(self._totals[name], value)

    def _internal_energy(self, energy: Energy) -> float:
        """Return the energy of springs, and of the motion about the centre of mass, J."""
        mass = self._cloth.scene.sheet.mass
        centre = momentum(self._cloth) / mass
        return energy.motion - 0.5 * mass * float(centre @ centre)

    def _check_energy(self) -> None:
        cloth, scene, sheet = self._cloth, self._cloth.scene, self._cloth.scene.sheet
        energy, work = cloth.energy_by_kind(), cloth.work
        self._motion = max(self._motion, energy.motion)
        weight = sheet.mass * float(np.linalg.norm(scene.gravity))
        converted = self._motion + abs(work) + weight * sheet.diagonal
        if precision_for(scene) == 'single':
            converted += 0.5 * sheet.mass * (2 * sheet.diagonal) ** 2  # two diagonals per second
        # Rounding of positions, and of the sum that the energy is.
        away = float(np.abs(sheet.position).max()) + sheet.diagonal
        converted += rate_bounds(scene)[0] * sheet.mass * (1e-14 * away) ** 2
        converted += 1e-12 * abs(energy.gravitational)
        if converted == 0:
            return
        excess, allowed = energy.total - self._start - work, self._tolerance * converted
        if self._unknown_work:
            self._totals['advances with unknown work'] += 1
        elif self._tolerance > ENERGY:
            self._totals['advances with a long fixed step'] += 1
            self._note('share of the energy that a fixed step allows', excess / allowed)
        else:
            self._note('share of the converted energy', excess / converted)
        assert excess <= allowed, f'{excess:.3g} J too much, of {converted:.3g} J converted'
        if self._free:  # a fall stretches no spring
            self._totals['advances in free fall'] += 1
            excess = self._internal_energy(energy) - self._internal
            assert excess <= allowed, f'a fall put {excess:.3g} J into springs'

    def _check_depth(self, positions: np.ndarray) -> None:
        cloth, radius = self._cloth, self._cloth.sphere_radius
        whole = cloth.scene.sphere.radius
        points = positions.reshape(-1, 3) - cloth.sphere_position
        free, held = (
            float(max_penetration(points, self._triangles[which], radius))
            for which in (~self._held, self._held)
        )
        allowed = min(DEPTH, DEPTH_SHARE * whole)
        allowed += ROUNDING * (radius + cloth.scene.sheet.diagonal + np.abs(points).max())
        assert max(free, held) <= cloth.sphere_depth + allowed, 'penetration not reported'
        if radius == whole:  # a sphere that still grows is where it is
            assert free <= allowed, f'{free:.3g} m deep in the sphere, not held by pins'
            self._note('penetration', free)


def check_run(run: Run, totals: Counter[str], patience: float) -> None:
    """Advance a cloth as a run says and check it; close it after `patience` seconds."""
    # A small sphere in a cloth as fast as a bullet takes hundreds of collision steps per substep.
    end = time.monotonic() + patience
    cloth = run.cloth(energy_monitor=partial(CountingMonitor, totals=totals))
    invariants, slow = Invariants(cloth, totals), False
    for step in run.steps:
        if step.prepare(cloth):
            invariants.begin()
        before = totals['unknown work']
        advance = cloth.advance_stepwise(run.seconds(cloth, step.seconds))
        for _ in advance:
            if time.monotonic() > end:
                advance.close()
                slow = True
        invariants.check(unknown_work=totals['unknown work'] > before)
        if slow:
            break
    totals.update({'runs': 1, run.start: 1, 'runs closed': int(slow)})
    totals['runs rolled back'] += any(vars(cloth.rollbacks).values())
    totals.update(vars(cloth.rollbacks))
