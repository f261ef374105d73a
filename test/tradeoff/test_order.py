"""Order of every integrator, measured as the slope of its error against the substep."""

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators import INTEGRATORS

# Soft springs, substeps far below the stability limit and a short time: the error is then
# proportional to a power of the substep.
BASE = {
    'sheet.rows': 5,
    'sheet.columns': 6,
    'springs.structural': 5.0,
    'springs.shear': 2.5,
    'springs.bending': 0.5,
    'drag': 0.0,
    'wind.air_density': 0.0,
    'solver.precision': 'double',
    'rate': 50.0,
}
DISSIPATION = {'springs.damping': 0.02, 'drag': 2.0}
# The gusts begin and end at 0.1237 s, 0.1808 s, 0.2474 s, …, never at a multiple of the substep.
GUST = {'period': 0.1237, 'duration': 0.0571, 'direction': [0.3, 1.0, 0.5], 'speed': [2.0, 4.0]}
AIR = {'wind.air_density': 1.2, 'wind.velocity': [0.5, 2.0, 1.5]}
GUSTS = {**AIR, **{f'wind.gust.{name}': value for name, value in GUST.items()}}
FORCES = {
    'springs': {},
    'dashpots and drag': DISSIPATION,
    'air': AIR,
    'gusts': GUSTS,
    'everything': {**GUSTS, **DISSIPATION},
}
SECONDS = 0.4
SUBSTEPS = (32, 64, 128)
REFERENCE = 1024


def run(forces: dict, method: str, substeps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities of a sheet that is bulged and moves at the start."""
    solver = {'solver.method': method, 'solver.substeps': substeps}
    cloth = Cloth(Scene().with_parameters({**BASE, **forces, **solver}))
    start = cloth.positions.copy()
    x, y = start[..., 0], start[..., 1]
    start[..., 2] += 0.1 * np.cos(2 * x) * np.cos(3 * y)
    cloth.positions = start
    cloth.velocities = np.stack([0.3 * np.sin(3 * y), 0.2 * x, 0.4 * np.cos(2 * x + y)], -1)
    cloth.advance(SECONDS)
    return cloth.positions, cloth.velocities


@pytest.mark.parametrize('forces', FORCES)
def test_errors_fall_with_the_order_of_the_integrator(forces):
    # One reference for all: integrators must also agree on the limit.
    exact = run(FORCES[forces], 'position_verlet', REFERENCE)
    for method, integrator in INTEGRATORS.items():
        found = [run(FORCES[forces], method, substeps) for substeps in SUBSTEPS]
        for k in range(2):
            errors = [np.abs(state[k] - exact[k]).max() for state in found]
            np.testing.assert_allclose(-np.diff(np.log2(errors)), integrator.order, atol=0.1)
