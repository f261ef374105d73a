"""
What `solver.overload: coarsen` does: accuracy is given up until the machine keeps up.

First the tolerance is relaxed, down to the stability limit; then the grid is coarsened, each time
to twice the spacing, which makes an eighth of the work, and shown as before.  What a change will
cost is foreseen from what a substep costs now, so that one change does.  When the machine can
follow more again, the cloth goes back, step by step, to what was asked for.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

from ..model.resample import resample_scene
from ..model.time_step import substep_length
from ..scene import Scene

# Shares of real time: from which on a cloth is too dear, what a coarser one may take, and what a
# finer one must be foreseen to take before it is tried again.
_OVERLOADED = 0.75
_RELAXED = 0.65
_RECOVERED = 0.6
_LOOSEST = 1.0  # m
# Cost of a substep of few particles, s: that of calling the kernel.
_CALL = 5e-6


class Level(NamedTuple):
    """
    What may be simulated instead of what was asked for.

    Attributes
    ----------
    scene
        With another tolerance.
    spacing
        Of the grid, as a multiple of the scene's own.
    substep
        Its length, s.
    particles
        Of the grid.
    text
        What is given up.

    """

    scene: Scene
    spacing: int
    substep: float
    particles: int
    text: str


def _level(scene: Scene, simulated: Scene, spacing: int, text: str) -> Level:
    sheet = simulated.sheet
    return Level(scene, spacing, substep_length(simulated), sheet.rows * sheet.columns, text)


class Overload:
    """
    What the machine can follow.

    Attributes
    ----------
    asked
        The scene as it was asked for.
    depth
        How many levels lie between that and what is simulated; 0: nothing is given up.

    """

    def __init__(self, scene: Scene) -> None:
        self.asked = scene
        self.depth = 0

    @cached_property
    def _levels(self) -> list[Level]:
        """Ever coarser levels, each cheaper than the one before."""
        asked = self.asked
        levels = [_level(asked, asked, 1, 'as asked')]
        if asked.solver.overload != 'coarsen':
            return levels
        tolerance = asked.solver.tolerance
        while tolerance < _LOOSEST:
            tolerance = min(2 * tolerance, _LOOSEST)
            free = {'solver.substeps': 0, 'solver.tolerance': tolerance}
            try:
                scene = asked.with_parameters(free)
            except ValueError:  # it would take more substeps than what was asked for
                continue
            level = _level(scene, scene, 1, f'tolerance relaxed to {1e3 * tolerance:g} mm')
            if level.substep > levels[-1].substep:
                levels.append(level)
        scene, spacing = levels[-1].scene, 2
        if scene.solver.substeps:
            scene = asked.with_parameters({'solver.substeps': 0, 'solver.tolerance': _LOOSEST})
        while (coarse := resample_scene(scene, 1 / spacing)) is not None:
            levels.append(_level(scene, coarse, spacing, f'grid {spacing} times coarser'))
            spacing *= 2
        return levels

    @property
    def level(self) -> Level:
        """What is to be simulated now."""
        return self._levels[self.depth]

    def relax(self, cost: float) -> bool:
        """
        Take the finest level that the machine can follow, if it cannot follow this one.

        Parameters
        ----------
        cost
            Of a substep now, s.

        Returns
        -------
        bool
            True if the level has changed.

        """
        before, now = self.depth, self.level
        if cost / now.substep > _OVERLOADED:
            last = len(self._levels) - 1
            while self.depth < last and _load(self.level, now, cost) > _RELAXED:
                self.depth += 1
        return self.depth != before

    def recover(self, cost: float) -> bool:
        """Take the next finer level, if that is foreseen to cost little enough; see `relax`."""
        if self.depth == 0:
            return False
        if _load(self._levels[self.depth - 1], self.level, cost) >= _RECOVERED:
            return False
        self.depth -= 1
        return True


def _load(level: Level, now: Level, cost: float) -> float:
    """Return the share of real time that a level will take, if a substep now costs `cost`."""
    foreseen = cost * level.particles / now.particles
    return max(foreseen, min(cost, _CALL)) / level.substep
