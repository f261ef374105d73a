"""What is promised for every scene, checked while a trial runs."""

from __future__ import annotations

import math
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from cloth_ros import Cloth, Scene
from cloth_ros.model.contact.continuous_collision import max_penetration
from cloth_ros.model.energy import Energy
from cloth_ros.model.grid import Array
from cloth_ros.model.time_step import precision_for

from .scenes import Input, Trial

# Energy that may be too much, as a share of what is turned over; with `solver.substeps` given,
# what the method makes of an oscillator at that step, where that is more.
ENERGY = 0.05
# Depth of a triangle in the sphere, m and as a share of its radius, and of positions in single
# precision, as a share of their size.
DEPTH = 1e-4
_DEPTH_SHARE = 1e-2
_ROUNDING = 1e-6
# Wall-clock time of a trial, s, after which it is cut: a small sphere in a cloth as fast as a
# bullet takes hundreds of strides in each of its substeps.
PATIENCE = 1.5


class BrokenPromiseError(AssertionError):
    """A promise was not kept; the text says which."""


@dataclass
class Outcome:
    """
    What the trials came to.

    Attributes
    ----------
    trials, cut, advances
        How many trials were run to their end, or cut as they took too long, and their advances.
    free
        How many of the advances were of sheets without pins, air and sphere.
    found
        In how many of them the work of the sphere was taken as it was found, then or since the
        start: their energy says nothing of what the guard lets pass.
    energy
        Greatest energy too much in the others, as a share of what was turned over.
    given, swing
        How many of the others had a step so long, by `solver.substeps`, that energy may swing by
        more than that; and the same of these, as a share of what it may swing by.
    depth
        Greatest depth of a triangle in the sphere that no pin holds there, m.
    stretches, any_work
        How many stretches of substeps the guard looked at, and in how many of these the sphere
        did work that is not known, as it grew or could not be got out of the way of.
    repeats
        Stretches that were repeated, by how.
    repeated
        Trials with any.
    starts
        Trials by the state that they start from.

    """

    trials: int = 0
    cut: int = 0
    advances: int = 0
    free: int = 0
    found: int = 0
    energy: float = 0.0
    given: int = 0
    swing: float = 0.0
    depth: float = 0.0
    stretches: int = 0
    any_work: int = 0
    rollbacks: Counter[str] = field(default_factory=Counter)
    repeated: int = 0
    starts: Counter[str] = field(default_factory=Counter)

    def add(self, other: Outcome) -> None:
        """Add what other trials came to."""
        counts = ('trials', 'cut', 'advances', 'free', 'found', 'given')
        for name in (*counts, 'stretches', 'any_work', 'repeated'):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in ('energy', 'swing', 'depth'):
            setattr(self, name, max(getattr(self, name), getattr(other, name)))
        self.rollbacks.update(other.rollbacks)
        self.starts.update(other.starts)


def _triangles(rows: int, columns: int) -> Array:
    """Return the corners of all triangles, both diagonals; segments and points where none are."""
    number = np.arange(rows * columns).reshape(rows, columns)
    if rows == 1 or columns == 1:
        line = number.ravel()
        return np.stack([line[:-1], line[1:], line[1:]] if len(line) > 1 else [line] * 3, axis=1)
    quad = (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:])
    kinds = [quad[:k] + quad[k + 1 :] for k in range(4)]
    return np.concatenate([np.stack([part.ravel() for part in kind], axis=1) for kind in kinds])


def _tolerance(scene: Scene) -> float:
    """
    Return the energy that may be too much, as a share of what is turned over.

    Position Verlet takes the energy E of an oscillator to E / (1 − φ) at most, φ = h² λ / 4; of
    the energy in motion then, which what is turned over holds, that is φ more.
    """
    if not scene.solver.substeps:
        return ENERGY
    step = 1 / (scene.rate * scene.solver.substeps)
    return max(ENERGY, 0.25 * step**2 * scene.rate_bounds()[0])


class Watch:
    """
    Watches one cloth.

    Raises
    ------
    BrokenPromiseError
        From `check`, when something is not as promised.

    """

    def __init__(self, cloth: Cloth, outcome: Outcome) -> None:
        self._cloth, self._outcome = cloth, outcome
        sheet = cloth.scene.sheet
        self._triangles = _triangles(sheet.rows, sheet.columns).astype(np.int32)
        self.begin()

    def begin(self) -> None:
        """Take the present state for the start: it, or the scene, was set from outside."""
        cloth = self._cloth
        energy = cloth.energy_by_kind()
        self._start, self._motion = energy.total - cloth.work, energy.motion
        self._found = False
        self._tolerance = _tolerance(cloth.scene)
        self._internal = self._about_the_centre(energy)
        self._pinned = cloth.scene.pinned()
        sphere = cloth.scene.sphere.radius > 0
        self._free = not (self._pinned.any() or sphere or cloth.scene.has_air)
        self._pins = cloth.positions[self._pinned]
        self._held = self._pinned.ravel()[self._triangles].any(axis=1)

    def check(self, *, found: bool = False) -> None:
        """Check everything; some work of the sphere was taken as it was `found` since the last."""
        cloth = self._cloth
        self._found |= found
        positions, velocities = cloth.positions, cloth.velocities
        if not (np.isfinite(positions).all() and np.isfinite(velocities).all()):
            raise BrokenPromiseError('not finite')
        if not np.array_equal(positions[self._pinned], self._pins):
            raise BrokenPromiseError('a pin has moved')
        if velocities[self._pinned].any():
            raise BrokenPromiseError('a pin has a velocity')
        self._check_energy()
        self._check_depth(positions)
        self._outcome.advances += 1

    def _about_the_centre(self, energy: Energy) -> float:
        """Return the energy of springs, and of the motion about the centre of mass, J."""
        cloth = self._cloth
        centre = cloth.velocities.mean(axis=(0, 1))
        return energy.motion - 0.5 * cloth.scene.sheet.mass * float(centre @ centre)

    def _check_energy(self) -> None:
        cloth, scene = self._cloth, self._cloth.scene
        energy, work = cloth.energy_by_kind(), cloth.work
        sheet = scene.sheet
        self._motion = max(self._motion, energy.motion)
        weight = sheet.mass * float(np.linalg.norm(scene.gravity))
        turnover = self._motion + abs(work) + weight * sheet.diagonal
        if precision_for(scene) == 'single':
            turnover += 0.5 * sheet.mass * (2 * sheet.diagonal) ** 2  # at two diagonals a second
        # Rounding of the positions, and of the sum that energy is.
        stiffness = scene.rate_bounds()[0] * sheet.mass
        away = float(np.abs(sheet.position).max()) + sheet.diagonal
        turnover += stiffness * (1e-14 * away) ** 2 + 1e-12 * abs(energy.gravitational)
        excess = energy.total - self._start - work
        if turnover == 0:
            return
        outcome, allowed = self._outcome, self._tolerance * turnover
        if self._found:
            outcome.found += 1
        elif self._tolerance > ENERGY:
            outcome.given += 1
            outcome.swing = max(outcome.swing, excess / allowed)
        else:
            outcome.energy = max(outcome.energy, excess / turnover)
        if excess > allowed:
            raise BrokenPromiseError(
                f'{excess:.3g} J from nowhere, of {turnover:.3g} J turned over'
            )
        if self._free:  # a fall stretches no spring
            outcome.free += 1
            excess = self._about_the_centre(energy) - self._internal
            if excess > allowed:
                raise BrokenPromiseError(f'{excess:.3g} J of a fall in springs')

    def _check_depth(self, positions: Array) -> None:
        cloth = self._cloth
        radius = cloth.sphere_radius
        if radius == 0:
            return
        points = positions.reshape(-1, 3) - cloth.sphere_position
        free, held = (
            float(max_penetration(points, self._triangles[which], radius))
            for which in (~self._held, self._held)
        )
        allowed = min(DEPTH, _DEPTH_SHARE * cloth.scene.sphere.radius)
        allowed += _ROUNDING * (radius + cloth.scene.sheet.diagonal + np.abs(points).max())
        if max(free, held) > cloth.sphere_depth + allowed:
            deep = max(free, held)
            raise BrokenPromiseError(f'a triangle is {deep:.3g} m deep in the sphere, unsaid')
        if radius < cloth.scene.sphere.radius:  # a growing sphere is where it is
            return
        if free > allowed:
            raise BrokenPromiseError(f'a triangle is {free:.3g} m deep in the sphere, unpinned')
        self._outcome.depth = max(self._outcome.depth, free)


class Counted(Cloth):
    """
    A cloth that counts what its guard looks at.

    Attributes
    ----------
    stretches, any_work
        See `Outcome`.

    """

    def __init__(self, scene: Scene) -> None:
        self.stretches = self.any_work = 0
        super().__init__(scene)

    def _accept(self, work: float, *, touched: bool = False) -> bool:
        self.stretches += 1
        self.any_work += work == math.inf
        return super()._accept(work, touched=touched)


def apply(trial: Trial, cloth: Cloth, what: Input, watch: Watch) -> None:
    """Do what an input says, before its advance."""
    scene = cloth.scene
    if what.reset:
        cloth.reset()
        watch.begin()
    if what.change:
        with suppress(ValueError):  # more substeps than any machine can take, or fewer than due
            cloth.configure(scene.with_parameters(dict(what.change)))
        watch.begin()
    if what.wind is not None:
        cloth.wind = what.wind
    if what.sphere is not None and cloth.scene.sphere.radius > 0:
        reach = cloth.scene.sheet.diagonal + cloth.scene.sphere.radius
        centre = np.array(scene.sheet.position) + reach * np.array(what.sphere)
        with suppress(ValueError):  # too far away
            cloth.move_sphere(centre.tolist())


def run(trial: Trial, outcome: Outcome, patience: float = PATIENCE) -> None:
    """
    Run a trial to its end.

    Parameters
    ----------
    trial, outcome
        What to run, and where to count it.
    patience
        Wall-clock time, s, after which it is cut.

    Raises
    ------
    BrokenPromiseError
        A promise was not kept.

    """
    cloth = trial.cloth(Counted)
    done = _runs_to_its_end(trial, cloth, Watch(cloth, outcome), time.monotonic() + patience)
    outcome.trials += done
    outcome.cut += not done
    outcome.starts[trial.start] += 1
    counts = vars(cloth.rollbacks)
    outcome.rollbacks.update(counts)
    outcome.repeated += any(counts.values())
    outcome.stretches += cloth.stretches
    outcome.any_work += cloth.any_work


def _runs_to_its_end(trial: Trial, cloth: Counted, watch: Watch, end: float) -> bool:
    """Run a trial, and tell if it was done by `end`; else its last good state is checked."""
    for what in trial.inputs:
        apply(trial, cloth, what, watch)
        before, done = cloth.any_work, True
        advance_stepwise = cloth.advance_stepwise(trial.seconds(cloth, what.seconds))
        for _ in advance_stepwise:
            if time.monotonic() > end:
                advance_stepwise.close()
                done = False
        watch.check(found=cloth.any_work > before)
        if not done:
            return False
    return True
