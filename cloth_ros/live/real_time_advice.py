"""
Why a scene is too slow for real time, and which parameters would make it fast enough.

The load, the share of real time that a scene takes, is the cost of a substep divided by its
length.  The cost was measured and is proportional to the number of particles; the length follows
from the parameters (`model/time_step.py`, `model/stability.py`).  Each remedy alone lowers the
predicted load to `RELAXED`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

from ..model.forces.springs import SPRING_TYPES
from ..model.stability import largest_eigenvalue, rate_bounds
from ..model.time_step import (
    check_time_step,
    dashpots_limit,
    integrator_for,
    stability_limit,
    usual_substep,
)
from ..scene import Scene
from ..scene.parameter import PARAMETERS
from ..scene.yaml_text import write
from .overload import RELAXED, Level, Overload, level_of, predicted_load

_BISECTIONS = 14  # to 1 % of any range
# Factor by which one type of springs may be stiffer than the others in a proportion that is meant.
_OUT_OF_PROPORTION = 20.0
# Factor by which a tolerance must shorten substeps to count as the cause of their number.
_DECISIVE = 2.4
_LEAST_SIDE = 3  # particles along a side of a coarser grid


class Remedy(NamedTuple):
    """
    Changes of parameters that together make a scene fast enough.

    Attributes
    ----------
    changes
        New values by the names of the parameters.
    load
        Predicted share of real time.
    note
        What else is to be said about it; empty if nothing is.

    """

    changes: dict[str, Any]
    load: float
    note: str = ''

    @property
    def text(self) -> str:
        """The changes as lines of a parameter file, in one line."""
        changes = ', '.join(f'{name}: {write(value)}' for name, value in self.changes.items())
        return f'{changes} ({self.note})' if self.note else changes


def _rounded(value: float, rounding: Callable[[float], int]) -> float:
    """Return a positive value, rounded up or down to two digits."""
    if value == 0:
        return 0.0
    exponent = math.floor(math.log10(value)) - 1
    return float(f'{rounding(value / 10.0**exponent)}e{exponent}')


def _level(scene: Scene) -> Level:
    return level_of(scene, scene, 1, '')


def _stiffest(scene: Scene) -> str:
    """Return the type of springs that contributes most to the largest eigenvalue."""
    return max(SPRING_TYPES, key=partial(_eigenvalue, scene))


def _eigenvalue(scene: Scene, *types: str, unit: bool = False) -> float:
    """Return the bound of the eigenvalue, N/m, with these types of springs alone."""
    weights = (
        (1.0 if unit else getattr(scene.springs, name)) * (name in types) for name in SPRING_TYPES
    )
    structural, shear, bending = weights
    return largest_eigenvalue(scene.sheet.rows, scene.sheet.columns, (structural, shear, bending))


def cause(scene: Scene) -> str:
    """Return why a scene takes as many substeps as it does, in words."""
    substep, sheet = usual_substep(scene), scene.sheet
    if scene.solver.substeps:
        return f'solver.substeps is {scene.solver.substeps}'
    if 1 / scene.rate < 1.5 * substep:
        return f'rate is {scene.rate:g} Hz'
    # Below this factor, it is the stiffness that leaves the tolerance little to decide.
    if usual_substep(scene.with_parameters({'solver.tolerance': 1.0})) > _DECISIVE * substep:
        return f'solver.tolerance is {scene.solver.tolerance:g} m'
    heavy = min(100 * sheet.mass, PARAMETERS['sheet.mass'].high or math.inf)
    if usual_substep(scene.with_parameters({'sheet.mass': heavy})) == substep:
        return 'so small a sheet is simulated in short substeps'
    if dashpots_limit(scene):
        return f'springs.damping is {scene.springs.damping:g} N·s/m at a mass of {sheet.mass:g} kg'
    stiffest = _stiffest(scene)
    stiffness = getattr(scene.springs, stiffest)
    return f'springs.{stiffest} is {stiffness:g} N/m at a mass of {sheet.mass:g} kg'


class _Search:
    """Search for changes of a scene whose substep costs so much, s."""

    def __init__(self, scene: Scene, cost: float) -> None:
        self._scene, self._cost = scene, cost
        self._now = _level(scene)

    def load(self, changes: dict[str, Any]) -> float:
        """Return the predicted load with other parameters; inf if they are not allowed."""
        try:
            changed = self._scene.with_parameters(changes)
            check_time_step(changed)
        except ValueError:
            return math.inf
        return predicted_load(_level(changed), self._now, self._cost)

    def is_enough(self, changes: dict[str, Any]) -> bool:
        """Return whether a change makes the scene fast enough."""
        return self.load(changes) <= RELAXED

    def least(self, name: str) -> float | None:
        """Return the least value of a parameter, above the present one, that is enough."""
        low, high = self._scene.flat()[name], PARAMETERS[name].high
        assert high is not None
        if not self.is_enough({name: float(high)}):
            return None
        for _ in range(_BISECTIONS):
            middle = math.sqrt(low * high)
            if self.is_enough({name: middle}):
                high = middle
            else:
                low = middle
        return float(min(_rounded(high, math.ceil), PARAMETERS[name].high or math.inf))

    def softer(self, mass: float) -> dict[str, Any]:
        """
        Return the stiffness and damping that allow the same substep as a mass would.

        One type of springs is changed, if that is enough, and all in proportion otherwise.  The
        largest eigenvalue of a sum of matrices is at most the sum of theirs: what the others leave
        is for the stiffest type.
        """
        scene = self._scene
        factor = scene.sheet.mass / mass
        heavy = scene.with_parameters({'sheet.mass': mass})
        limit = stability_limit(heavy)
        elastic, viscous = rate_bounds(scene)
        stable_step = integrator_for(scene).stable_step
        changes: dict[str, Any] = {}
        if stable_step(0.0, viscous) < limit:
            changes['springs.damping'] = _rounded(factor * scene.springs.damping, math.floor)
        if stable_step(elastic, 0.0) < limit:
            name = _stiffest(scene)
            others = [other for other in SPRING_TYPES if other != name]
            allowed = factor * _eigenvalue(scene, *SPRING_TYPES)
            unit, softer = _eigenvalue(scene, name, unit=True), _eigenvalue(scene, *others)
            stiffness = {each: getattr(scene.springs, each) for each in SPRING_TYPES}
            if allowed - softer > 0.1 * allowed:
                stiffness = {name: (allowed - softer) / unit}
            else:
                if stiffness[name] * unit > _OUT_OF_PROPORTION * softer:
                    stiffness[name] = softer / unit
                    factor = allowed / (2 * softer)
                stiffness = {each: factor * value for each, value in stiffness.items()}
            for each, value in stiffness.items():
                if getattr(scene.springs, each) > 0:
                    changes[f'springs.{each}'] = _rounded(value, math.floor)
        return changes

    def coarser(self) -> dict[str, Any]:
        """Return the finest grid, of the same proportions, that is fast enough; {} if none is."""
        sheet = self._scene.sheet
        sides = (sheet.rows, sheet.columns)

        def grid(longest: int) -> dict[str, Any]:
            share = (longest - 1) / (max(sides) - 1)
            rows, columns = (
                min(side, max(round((side - 1) * share) + 1, _LEAST_SIDE)) for side in sides
            )
            return {'sheet.rows': rows, 'sheet.columns': columns}

        low, high = _LEAST_SIDE, max(sides)
        if high <= low or not self.is_enough(grid(low)):
            return {}
        while high - low > 1:
            middle = (low + high) // 2
            if self.is_enough(grid(middle)):
                low = middle
            else:
                high = middle
        return grid(low)

    def longer_substeps(self) -> Iterator[dict[str, Any]]:
        """Yield changes that lengthen the substeps, each of which may be enough."""
        scene = self._scene
        tick = 1 / scene.rate
        affordable = math.floor(RELAXED * tick / self._cost)  # substeps per tick
        if scene.solver.substeps:
            yield {'solver.substeps': affordable}
            yield {'solver.substeps': 0}
        else:
            if (tolerance := self.least('solver.tolerance')) is not None:
                yield {'solver.tolerance': tolerance}
            if (mass := self.least('sheet.mass')) is not None:
                yield self.softer(mass)
                yield {'sheet.mass': mass}
        yield {'rate': _rounded(RELAXED / self._cost, math.floor)}


def remedies(scene: Scene, cost: float, *, coarser_only: bool = False) -> list[Remedy]:
    """
    Return changes of a scene, each of which alone makes it fast enough.

    Parameters
    ----------
    scene
        The scene that is simulated.
    cost
        Cost of a substep, s.
    coarser_only
        True for fewer particles only, where longer substeps would not help.

    """
    search = _Search(scene, cost)
    found: list[Remedy] = []
    longer = () if coarser_only else search.longer_substeps()
    for changes in (*longer, search.coarser()):
        load = search.load(changes) if changes else math.inf
        if load <= RELAXED:
            found.append(Remedy(changes, load))
    if scene.solver.overload != 'coarsen':
        changes = {'solver.overload': 'coarsen'}
        overload = Overload(scene.with_parameters(changes))
        overload.relax(cost)
        load = predicted_load(overload.level, _level(scene), cost)
        if load <= RELAXED:
            found.append(Remedy(changes, load, overload.level.text))
    return found


def advice(scene: Scene, cost: float) -> str:
    """
    Return why a scene is too slow, and what would make it real time, in one line.

    Parameters
    ----------
    scene
        The scene that is simulated.
    cost
        Cost of a substep, s.

    """
    substep = usual_substep(scene)
    sheet = scene.sheet
    text = (
        f'{1 / (scene.rate * substep):.0f} substeps a tick, each {1e6 * cost:.2g} µs of processor '
        f'time, take {100 * cost / substep:.0f} % of real time, because {cause(scene)} on '
        f'{sheet.rows} × {sheet.columns} particles'
    )
    choices = ' | '.join(remedy.text for remedy in remedies(scene, cost))
    if not choices:
        return f'{text}; no single parameter can change that enough'
    full = ' at full accuracy' if scene.solver.overload == 'coarsen' else ''
    return f'{text}; one of these makes it real time{full}: {choices}'
