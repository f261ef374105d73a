"""
What `solver.overload: coarsen` does: the tolerance is relaxed until the machine keeps up.

It ends at the stability limit; what is still missing then is time, as with `slow_motion`.  What a
change will cost is foreseen from what a substep costs now, so that one change does.  When the
machine can follow more again, the cloth goes back, step by step, to what was asked for.
"""

from __future__ import annotations

from functools import cached_property

from ..model import Scene
from ..model.substeps import substep_length

# Shares of real time: from which on a cloth is too dear, what a coarser one may take, and what a
# finer one must be foreseen to take before it is tried again.
_OVERLOADED = 0.75
_RELAXED = 0.65
_RECOVERED = 0.6
_LOOSEST = 1.0  # m


class Overload:
    """
    The scene that the machine can follow.

    Attributes
    ----------
    asked
        The scene as it was asked for.
    level
        How far it is coarsened; 0: not at all.

    """

    def __init__(self, scene: Scene) -> None:
        self.asked = scene
        self.level = 0

    @cached_property
    def _ladder(self) -> list[tuple[Scene, str]]:
        """Ever coarser scenes, each cheaper than the one before, and what they are."""
        asked = self.asked
        scenes = [(asked, 'as asked')]
        if asked.solver.overload != 'coarsen':
            return scenes
        free = asked.with_parameters({'solver.substeps': 0})
        tolerance, substep = asked.solver.tolerance, substep_length(asked)
        while tolerance < _LOOSEST:
            tolerance = min(2 * tolerance, _LOOSEST)
            relaxed = free.with_parameters({'solver.tolerance': tolerance})
            if substep_length(relaxed) > substep:
                substep = substep_length(relaxed)
                scenes.append((relaxed, f'tolerance relaxed to {tolerance:g} m'))
        return scenes

    @property
    def scene(self) -> Scene:
        """The scene as it is to be simulated now."""
        return self._ladder[self.level][0]

    def __str__(self) -> str:
        """Say what is given up."""
        return self._ladder[self.level][1]

    def relax(self, cost: float) -> bool:
        """
        Take the finest scene that the machine can follow, if it cannot follow this one.

        Parameters
        ----------
        cost
            Of a substep now, s.

        Returns
        -------
        bool
            True if the scene has changed.

        """
        before = self.level
        if cost / substep_length(self.scene) > _OVERLOADED:
            last = len(self._ladder) - 1
            while self.level < last and cost / substep_length(self.scene) > _RELAXED:
                self.level += 1
        return self.level != before

    def recover(self, cost: float) -> bool:
        """Take the next finer scene, if that is foreseen to cost little enough; see `relax`."""
        if self.level == 0:
            return False
        finer = self._ladder[self.level - 1][0]
        if cost / substep_length(finer) >= _RECOVERED:
            return False
        self.level -= 1
        return True
