"""What is tried: one setting after the other, and how a scene is run with it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass

from ..model import Cloth
from ..model.integrators import INTEGRATORS
from ..model.integrators.integrator import SubstepBatch
from ..model.stability import SAFETY
from ..model.time_step import CHECK_INTERVAL
from ..scene import Scene

# Substeps as multiples of the least that are stable.  Those below one are there to be shown
# as what they are.
_FACTORS = (0.6, 0.8, 1.0, 1.4, 2.0, 2.8, 4.0)
_FACTORS_QUICK = (0.7, 1.0, 2.0)
_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Setting:
    """
    One way to simulate a scene.

    Attributes
    ----------
    method, precision
        As in `solver`.
    substeps
        Per tick, all of one length and with no regard to stability; 0: the solver's own choice.
    tolerance
        m, what the solver's own choice aims at.
    rate
        Ticks per second, Hz.

    """

    method: str
    precision: str
    substeps: int
    tolerance: float
    rate: float

    @property
    def label(self) -> str:
        """Say in a few words what is special about it."""
        if self.substeps:
            return f'{self.method}, {self.substeps} substeps, {self.precision}'
        return f'{self.method}, tolerance {1e3 * self.tolerance:g} mm, {self.precision}'

    @property
    def parameters(self) -> dict[str, object]:
        """The parameters of a scene that make this setting."""
        return {
            'solver.method': self.method,
            'solver.precision': self.precision,
            'solver.substeps': self.substeps,
            'solver.tolerance': self.tolerance,
            'rate': self.rate,
        }

    def as_dict(self) -> dict[str, object]:
        """Return the fields by name."""
        return asdict(self)


class FixedStepCloth(Cloth):
    """A cloth whose substeps are all of one length, stable or not."""

    monitored = False  # where a step breaks, the study must see it break

    def __init__(self, scene: Scene, substeps: int) -> None:
        self._number = substeps
        super().__init__(scene)

    @property
    def substep(self) -> float:
        """Length of the substeps, s."""
        return 1 / (self.scene.rate * self._number)

    def _blocks(self, count: int, h: float, division: int) -> Iterator[SubstepBatch]:
        for first in range(0, count, CHECK_INTERVAL):
            self._follow()
            part = min(CHECK_INTERVAL, count - first)
            self._substeps += part
            yield SubstepBatch(part, h)


def make_cloth(scene: Scene, setting: Setting) -> Cloth:
    """Return the cloth of a scene with a setting; the number of substeps is taken as it is."""
    changes = setting.parameters
    if not setting.substeps:
        return Cloth(scene.with_parameters(changes))
    scene = scene.with_parameters({**changes, 'solver.substeps': 0})
    return FixedStepCloth(scene, setting.substeps)


def least_substeps(scene: Scene, method: str) -> int:
    """Return the least number of substeps a tick that is stable in every state of the cloth."""
    limit = scene.with_parameters(
        {'solver.method': method, 'solver.substeps': 0}
    ).stability_limit()
    return max(math.ceil(1 / (scene.rate * SAFETY * limit)), 1)


def plan(scene: Scene, *, quick: bool) -> list[Setting]:
    """
    Return the settings to try on the grid and at the rate of a scene, each once.

    The scene's own setting is the first.
    """
    solver = scene.solver
    settings = [
        Setting(solver.method, solver.precision, solver.substeps, solver.tolerance, scene.rate)
    ]
    for precision in ('single', 'double'):
        for method in INTEGRATORS:
            least = least_substeps(scene, method)
            for factor in _FACTORS_QUICK if quick else _FACTORS:
                substeps = max(round(factor * least), 1)
                settings.append(Setting(method, precision, substeps, 1e-3, scene.rate))
        for tolerance in _TOLERANCES:
            settings.append(Setting('auto', precision, 0, tolerance, scene.rate))
    return list(dict.fromkeys(settings))


def rates(scene: Scene, *, quick: bool) -> list[Setting]:
    """Return the settings that differ in the rate of the ticks alone."""
    solver = scene.solver
    wanted = [0.5, 1.0, 2.0] if quick else [0.5, 1.0, 2.0, 4.0]
    return [
        Setting('auto', solver.precision, 0, solver.tolerance, factor * scene.rate)
        for factor in wanted
        if 1 <= factor * scene.rate <= 1000
    ]
