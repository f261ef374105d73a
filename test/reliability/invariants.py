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
from reliability.penetration import distance_of, half_width, is_pressed, overlap
from reliability.random_colliders import FAR
from reliability.random_scenes import Run

from cloth_ros import Cloth, Energy, Scene
from cloth_ros.model.contact.collider import Collider
from cloth_ros.model.energy_monitor import EnergyMonitor
from cloth_ros.model.precision import precision_for
from cloth_ros.model.stability import rate_bounds

# Tolerated excess of energy, as a share of the energy that is converted.
ENERGY = 0.05
# Tolerated penetration: m, as a share of the radius, and for positions in single precision as a
# share of their size.
DEPTH, DEPTH_SHARE, ROUNDING = 1e-4, 1e-2, 1e-6
MOST_CHECKED = 20  # triangles in a collider, of which the deepest are looked at


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
        self._free = not (self._pinned.any() or scene.all_colliders() or scene.has_air)

    def check(self, *, unknown_work: bool = False, closed: bool = False) -> None:
        """
        Check everything; since the last check, the work of the sphere may be unknown.

        The depth at pins is reported at the end of an advance, and not of a `closed` one.
        """
        cloth = self._cloth
        self._unknown_work |= unknown_work
        positions, velocities = cloth.positions, cloth.velocities
        assert np.isfinite(positions).all(), 'not finite'
        assert np.isfinite(velocities).all(), 'not finite'
        assert np.array_equal(positions[self._pinned], self._pins), 'a pin has moved'
        assert not velocities[self._pinned].any(), 'a pin has a velocity'
        self._check_energy()
        near = [each for each in cloth.colliders.values() if not each.name.startswith(FAR)]
        for collider in near:
            self._check_depth(positions.reshape(-1, 3), collider, near, reported=not closed)
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

    def _check_depth(
        self, positions: np.ndarray, collider: Collider, near: list[Collider], *, reported: bool
    ) -> None:
        """Check the depth in a collider, unless it grows; `near` are all that may press too."""
        if collider.inset > 0:
            return
        sheet, width = self._cloth.scene.sheet, half_width(collider)
        start = np.array(sheet.position if self._pinned.any() else positions.mean(axis=0))
        spread = sheet.diagonal + float(np.linalg.norm(positions - start, axis=1).max())
        allowed = min(DEPTH, DEPTH_SHARE * width) + ROUNDING * (spread + min(width, spread))
        distance = distance_of(collider)
        found = overlap(positions[self._triangles], distance, allowed)
        held = self._held[found.triangles]
        deepest = np.flatnonzero(~held)
        deepest = deepest[np.argsort(-found.depth[deepest])[:MOST_CHECKED]]
        where = f'm deep in the {collider.type} {collider.name}'
        for depth, triangle, point in zip(*(each[deepest] for each in found), strict=True):
            if self._is_pressed(positions, triangle, point, collider, near, allowed):
                self._totals['pressed between colliders'] += 1
                continue
            raise AssertionError(f'{depth:.3g} {where}, not held by pins, {allowed:.3g} m allowed')
        if held.any():
            self._totals['held by pins'] += 1
            depth = float(found.depth[held].max()) if reported else 0.0
            self.check_reported(depth, collider.max_penetration + allowed, where)

    def check_reported(self, depth: float, most: float, where: str) -> None:
        """Check that a depth, m, where pins hold the sheet, is not above what is reported."""
        assert depth <= most, f'{depth:.3g} {where}, not reported'

    def _is_pressed(
        self,
        positions: np.ndarray,
        triangle: int,
        point: np.ndarray,
        collider: Collider,
        near: list[Collider],
        allowed: float,
    ) -> bool:
        """Tell if another collider presses a triangle, or one beside it, from another side."""
        corners = self._triangles[triangle]
        beside = self._triangles[np.isin(self._triangles, corners).any(axis=1)]
        parts = positions[beside]
        edges = np.linalg.norm(parts - np.roll(parts, 1, axis=1), axis=2)
        points = np.concatenate([positions[np.unique(beside)], parts.mean(axis=1), point[None]])
        reach = float(edges.max()) + allowed
        one = distance_of(collider)
        return any(
            is_pressed(points, point, one, distance_of(other), reach + other.inset)
            for other in near
            if other is not collider
        )


def check_run(
    run: Run, totals: Counter[str], most: float = math.inf, patience: float = math.inf
) -> None:
    """
    Advance a cloth as a run says and check it.

    Close it after `most` batches of substeps, or `patience` seconds: a small sphere in a cloth as
    fast as a bullet takes hundreds of collision steps per substep.
    """
    end = time.monotonic() + patience
    cloth = run.cloth(energy_monitor=partial(CountingMonitor, totals=totals))
    invariants, batches, long = Invariants(cloth, totals), 0, False
    for step in run.steps:
        if step.prepare(cloth):
            invariants.begin()
        before, seconds = totals['unknown work'], run.seconds(cloth, step.seconds)
        step.move(cloth, seconds)
        advance = cloth.advance_stepwise(seconds)
        for _ in advance:
            batches += 1
            if batches > most or time.monotonic() > end:
                advance.close()
                long = True
        invariants.check(unknown_work=totals['unknown work'] > before, closed=long)
        if long:
            break
    totals.update({'runs': 1, run.start: 1, 'runs closed': int(long)})
    totals['runs with colliders'] += len(cloth.scene.colliders) > 0
    totals['runs rolled back'] += any(vars(cloth.rollbacks).values())
    totals.update(vars(cloth.rollbacks))
