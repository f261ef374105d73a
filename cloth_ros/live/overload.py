"""
Overload with `solver.overload: coarsen`: accuracy is reduced until the machine keeps up.

First the tolerance is relaxed, as far as the stability limit allows.  Then the grid is coarsened,
each time to twice the spacing, which leaves an eighth of the work; the published grid stays the
same.  The cost of a level is predicted from the present cost of a substep, so that one change is
enough.  When the machine can do more again, accuracy is restored level by level.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

from ..model.resample import resample_scene
from ..model.time_step import check_time_step, usual_substep
from ..scene import Scene

# Shares of real time: above the first the cloth is too slow, a coarser level may take up to the
# second, and a finer level must be predicted to take less than the third to be tried again.
OVERLOADED = 0.75
RELAXED = 0.65
_RECOVERED = 0.6
_MAX_TOLERANCE = 1.0  # m
# Cost of a substep of few particles, s: that of calling the kernel.
_CALL = 5e-6


class Level(NamedTuple):
    """
    What is simulated in place of the requested scene.

    Attributes
    ----------
    scene
        The requested scene, or with another tolerance.
    spacing
        Spacing of the grid, as a multiple of the scene's own.
    substep
        Length of the substeps, s.
    particles
        Number of particles.
    text
        What is given up, in words.

    """

    scene: Scene
    spacing: int
    substep: float
    particles: int
    text: str


def level_of(scene: Scene, simulated: Scene, spacing: int, text: str) -> Level:
    """Return the level of a scene and of what is simulated for it."""
    sheet = simulated.sheet
    return Level(scene, spacing, usual_substep(simulated), sheet.rows * sheet.columns, text)


class Overload:
    """
    Choose the finest level that the machine can simulate in real time.

    Attributes
    ----------
    requested
        The requested scene.
    depth
        Number of levels between that and what is simulated; 0: nothing is given up.

    """

    def __init__(self, scene: Scene) -> None:
        self.requested = scene
        self.depth = 0

    @cached_property
    def _levels(self) -> list[Level]:
        """Levels from fine to coarse, each cheaper than the one before."""
        requested = self.requested
        levels = [level_of(requested, requested, 1, 'as requested')]
        if requested.solver.overload != 'coarsen':
            return levels
        tolerance = requested.solver.tolerance
        while tolerance < _MAX_TOLERANCE:
            tolerance = min(2 * tolerance, _MAX_TOLERANCE)
            free = {'solver.substeps': 0, 'solver.tolerance': tolerance}
            scene = requested.with_parameters(free)
            try:
                check_time_step(scene)
            except ValueError:  # it would take more substeps than what was requested
                continue
            level = level_of(scene, scene, 1, f'tolerance relaxed to {1e3 * tolerance:g} mm')
            if level.substep > levels[-1].substep:
                levels.append(level)
        scene, spacing = levels[-1].scene, 2
        if scene.solver.substeps:
            free = {'solver.substeps': 0, 'solver.tolerance': _MAX_TOLERANCE}
            scene = requested.with_parameters(free)
        while (coarse := resample_scene(scene, 1 / spacing)) is not None:
            levels.append(level_of(scene, coarse, spacing, f'grid {spacing} times coarser'))
            spacing *= 2
        return levels

    @property
    def level(self) -> Level:
        """The level to simulate now."""
        return self._levels[self.depth]

    def relax(self, cost: float) -> bool:
        """
        If the present level is too slow, choose the finest one that is fast enough.

        Parameters
        ----------
        cost
            Present cost of a substep, s.

        Returns
        -------
        bool
            True if the level has changed.

        """
        before, now = self.depth, self.level
        if cost / now.substep > OVERLOADED:
            last = len(self._levels) - 1
            while self.depth < last and predicted_load(self.level, now, cost) > RELAXED:
                self.depth += 1
        return self.depth != before

    def recover(self, cost: float) -> bool:
        """Choose the next finer level if its predicted cost is low enough; see `relax`."""
        if self.depth == 0:
            return False
        if predicted_load(self._levels[self.depth - 1], self.level, cost) >= _RECOVERED:
            return False
        self.depth -= 1
        return True


def predicted_load(level: Level, now: Level, cost: float) -> float:
    """Return the predicted share of real time of a level, if a substep now costs `cost`."""
    predicted = cost * level.particles / now.particles
    return max(predicted, min(cost, _CALL)) / level.substep
