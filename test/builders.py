"""Builders of scenes and cloths, and hypothesis settings, shared by the tests."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.forces.springs import SPRING_TYPES
from cloth_ros.model.integrators.integrator import SubstepBatch
from cloth_ros.model.state import State
from cloth_ros.model.step_control import ConstantStep
from cloth_ros.tradeoff.reference_model import tributary_areas

ROOT = Path(__file__).parent.parent
SCENE_FILES = sorted((ROOT / 'config').glob('*.yaml'))

# Parameters that leave springs and gravity alone, and springs alone on a free sheet.
VACUUM = {'wind__air_density': 0.0, 'drag': 0.0}
SPRINGS_ONLY = {**VACUUM, 'gravity': (0.0, 0.0, 0.0), 'pins': ['']}
# Air without an effect: each combination of forces has a kernel of its own, which takes seconds to
# compile, and with air more tests can share one.
NEGLIGIBLE_AIR = {'wind__air_density': 1e-20}

seeds = st.integers(0, 2**31)
# For parametrised tests; double precision has kernels of its own.
PRECISIONS = ['single', pytest.param('double', marks=pytest.mark.slow)]
precisions = st.sampled_from(['single', 'double'])


def examples(share: float) -> settings:
    """Return settings with a share of the examples of the hypothesis profile in use."""
    return settings(
        max_examples=max(round(share * settings.default.max_examples), 1), deadline=None
    )


def scene_of(**parameters: object) -> Scene:
    """Return a scene; two underscores in a name stand for the dot."""
    return Scene().with_parameters(
        {name.replace('__', '.'): value for name, value in parameters.items()}
    )


def cloth_of(**parameters: object) -> Cloth:
    """Return a cloth of a scene; two underscores in a name stand for the dot."""
    return Cloth(scene_of(**parameters))


def small_cloth(**parameters: object) -> Cloth:
    """Return a cloth of 6 × 7 particles, if the parameters do not set others."""
    return cloth_of(**{'sheet__rows': 6, 'sheet__columns': 7, **parameters})


def only(name: str | None) -> dict[str, float]:
    """Return the stiffness of the springs with one type alone, or with none."""
    return {f'springs__{other}': 300.0 * (other == name) for other in SPRING_TYPES}


def crumple(cloth: Cloth, size: float, seed: int = 0, *, speed: float = 0.0) -> Cloth:
    """Displace the free particles of a cloth at random by `size`, m, and set random velocities."""
    generator = np.random.default_rng(seed)
    free = ~cloth.scene.pinned()[..., None]
    shape = cloth.positions.shape
    cloth.positions = cloth.positions + free * generator.normal(0, size, shape)
    cloth.velocities = free * generator.normal(0, speed, shape)
    return cloth


def masses(cloth: Cloth) -> np.ndarray:
    """Return the masses of the particles, kg, shape (rows, columns, 1)."""
    sheet = cloth.scene.sheet
    return sheet.cell_mass * tributary_areas(sheet.rows, sheet.columns)[..., None]


def mean_by_mass(cloth: Cloth, field: np.ndarray) -> np.ndarray:
    """Return the mean of a field, shape (rows, columns, 3), weighted with the masses."""
    return (masses(cloth) * field).sum((0, 1)) / cloth.scene.sheet.mass


def momentum(cloth: Cloth) -> np.ndarray:
    """Return the momentum, kg m/s, shape (3,)."""
    return (masses(cloth) * cloth.velocities).sum((0, 1))


class FixedSteps(ConstantStep):
    """Step control: substeps of one length, s."""

    division = 1

    def __init__(self, substep: float) -> None:
        self.substep = substep

    def batches(self, state, count, h, division, airspeed):
        return [SubstepBatch(count, h)]


class Disturbance:
    """Observer that changes the state after the substeps of these numbers, or after each."""

    def __init__(self, disturb: Callable[[State], None], *substeps: int) -> None:
        self._disturb, self._substeps, self._count = disturb, substeps, 0

    def after_drift(self, state, step, air_velocity):
        pass

    def after_contact(self, state, step):
        self._count += 1
        if not self._substeps or self._count in self._substeps:
            self._disturb(state)


def overwrite(name: str, value: float) -> Callable[[State], None]:
    """Return a disturbance of a coordinate of one particle."""

    def disturb(state: State) -> None:
        getattr(state, name)[0, state.grid.begin + 20] = value

    return disturb


def bits(value: object) -> object:
    """Return a value that is equal for equal bits, in arrays and whatever holds them."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if dataclasses.is_dataclass(value):
        return [bits(getattr(value, field.name)) for field in dataclasses.fields(value)]
    if isinstance(value, Mapping):
        return {key: bits(item) for key, item in value.items()}
    return [bits(item) for item in value] if isinstance(value, (tuple, list)) else repr(value)


def run_python(text: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a program in a process of its own."""
    command = [sys.executable, '-c', text, *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, text=True, capture_output=True, timeout=240)
