"""The solver settings that a study compares, and the cloth of a scene with one of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from ..model import Cloth
from ..model.integrators import INTEGRATORS
from ..model.integrators.integrator import SubstepBatch
from ..model.stability import SAFETY
from ..model.state import State
from ..model.step_control import AdaptiveStepControl, ConstantStep
from ..model.time_step import stability_limit, substep_length, usual_substep
from ..scene import Scene

# Substeps per tick as multiples of the least stable number.  Factors below one are unstable, and
# shown as such.
_FACTORS = (0.6, 0.8, 1.0, 1.4, 2.0, 2.8, 4.0)
_FACTORS_QUICK = (0.7, 1.0, 2.0)
_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Setting:
    """
    One setting of the solver.

    Attributes
    ----------
    method, precision
        As in `solver`.
    substeps
        Per tick, all of one length, stable or not; 0: chosen by the solver.
    tolerance
        m, for the solver's choice of substeps.
    rate
        Ticks per second, Hz.
    follows_state
        False for substeps that are stable in every state, instead of those that the solver chooses
        by the present one: for comparison only, no parameter offers it.

    """

    method: str
    precision: str
    substeps: int
    tolerance: float
    rate: float
    follows_state: bool = True

    @property
    def label(self) -> str:
        """Short description for tables and progress."""
        if self.substeps:
            return f'{self.method}, {self.substeps} substeps, {self.precision}'
        text = f'{self.method}, tolerance {1e3 * self.tolerance:g} mm, {self.precision}'
        return text if self.follows_state else f'{text}, substeps fixed at the bound'

    @property
    def parameters(self) -> dict[str, object]:
        """Parameters of a scene with this setting."""
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


class FixedStepControl(ConstantStep):
    """
    Step control of constant substeps, stable or not, however fast the cloth moves.

    Parameters
    ----------
    scene
        Its rate.
    substeps
        Per tick.

    Attributes
    ----------
    substep
        Length of the substeps, s.
    division
        As in every step control; constant.

    """

    division = 1

    def __init__(self, scene: Scene, *, substeps: int) -> None:
        self.substep = 1 / (scene.rate * substeps)

    def batches(
        self, state: State, count: int, h: float, division: int, airspeed: float
    ) -> Iterable[SubstepBatch]:
        """Return one batch of `count` substeps of `h` s."""
        return (SubstepBatch(count, h),)


class EveryStateStepControl(AdaptiveStepControl):
    """
    Step control of substeps that are stable in every state, divided where fast motion needs it.

    Parameters
    ----------
    scene
        Parameters.
    division
        Divides every substep.

    """

    def __init__(self, scene: Scene, *, division: int = 1) -> None:
        super().__init__(scene, division=division)
        self._present, self.adapt_interval = None, math.inf


def make_cloth(scene: Scene, setting: Setting) -> Cloth:
    """
    Return the cloth of a scene with a setting.

    A fixed number of substeps is taken as it is, without the energy monitor: where a step is
    unstable, the study has to see the consequence.
    """
    if not setting.substeps:
        chosen = AdaptiveStepControl if setting.follows_state else EveryStateStepControl
        return Cloth(scene.with_parameters(setting.parameters), step_control=chosen)
    scene = scene.with_parameters({**setting.parameters, 'solver.substeps': 0})
    control = partial(FixedStepControl, substeps=setting.substeps)
    return Cloth(scene, step_control=control, energy_monitor=None)


def least_substeps(scene: Scene, method: str) -> int:
    """Return the least number of substeps per tick that is stable in every state of the cloth."""
    limit = stability_limit(scene.with_parameters({'solver.method': method}))
    return max(math.ceil(1 / (scene.rate * SAFETY * limit)), 1)


def state_matters(scene: Scene) -> bool:
    """Return whether substeps that follow the state of a cloth are longer than without."""
    return usual_substep(scene) > substep_length(scene)


def changed_pins(scene: Scene, resampled: Scene) -> list[str]:
    """Return the pins on another grid; none where those of the scene mean the same on it."""
    sides = {'sheet.rows': resampled.sheet.rows, 'sheet.columns': resampled.sheet.columns}
    try:
        unchanged = scene.with_parameters(sides).pinned()
    except ValueError:  # a particle that the other grid does not have
        return list(resampled.pins)
    return [] if np.array_equal(unchanged, resampled.pinned()) else list(resampled.pins)


def plan(scene: Scene, *, quick: bool) -> list[Setting]:
    """
    Return the settings to compare on the grid and at the rate of a scene, each once.

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
            setting = Setting('auto', precision, 0, tolerance, scene.rate)
            settings.append(setting)
            if state_matters(scene.with_parameters(setting.parameters)):
                settings.append(replace(setting, follows_state=False))
    return list(dict.fromkeys(settings))


def rates(scene: Scene, *, quick: bool) -> list[Setting]:
    """Return the settings to compare that differ in the rate of the ticks only."""
    solver = scene.solver
    wanted = [0.5, 1.0, 2.0] if quick else [0.5, 1.0, 2.0, 4.0]
    return [
        Setting('auto', solver.precision, 0, solver.tolerance, factor * scene.rate)
        for factor in wanted
        if 1 <= factor * scene.rate <= 1000
    ]
