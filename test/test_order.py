"""The order of every method, measured: the slope of its error over the step."""

import functools

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators import INTEGRATORS

# Soft springs of all families, steps far below the stability limit and a short time: the error
# is then in proportion to a power of the step.
BASE = {
    'sheet.rows': 5,
    'sheet.columns': 6,
    'drag': 0.0,
    'springs.structural': 5.0,
    'springs.shear': 2.5,
    'springs.bending': 0.5,
    'wind.air_density': 0.0,
    'solver.precision': 'double',
    'rate': 50.0,
}
AIR = {'wind.air_density': 1.2, 'wind.velocity': [0.5, 2.0, 1.5]}
# Edges at 0.1237 s, 0.1808 s, 0.2474 s, … that no substep of the rate comes to by itself.
GUSTS = {
    **AIR,
    'wind.gust.period': 0.1237,
    'wind.gust.duration': 0.0571,
    'wind.gust.direction': [0.3, 1.0, 0.5],
    'wind.gust.speed': [2.0, 4.0],
}
DASHPOTS = {'springs.damping': 0.02}
DRAG = {'drag': 2.0}

ANALYTIC_CASES = {
    'structural springs': {'springs.shear': 0.0, 'springs.bending': 0.0},
    'all springs': {},
    'dashpots': DASHPOTS,
    'drag': DRAG,
    'air': AIR,
    'gusts': GUSTS,
    'everything': {**GUSTS, **DASHPOTS, **DRAG},
}

SECONDS = 0.4
SUBSTEPS = (32, 64, 128)
REFERENCE = 1024


@functools.cache
def run(system: str, method: str, substeps: int) -> dict[str, np.ndarray]:
    """Simulate a sheet that is bulged and swings from the start."""
    cloth = Cloth(
        Scene().with_parameters(
            {
                **BASE,
                **ANALYTIC_CASES[system],
                'solver.method': method,
                'solver.substeps': substeps,
            }
        )
    )
    start = cloth.positions.copy()
    x, y = start[..., 0], start[..., 1]
    start[..., 2] += 0.1 * np.cos(2 * x) * np.cos(3 * y)
    cloth.positions = start
    cloth.velocities = np.stack([0.3 * np.sin(3 * y), 0.2 * x, 0.4 * np.cos(2 * x + y)], -1)
    cloth.advance(SECONDS)
    return {'positions': cloth.positions, 'velocities': cloth.velocities}


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('system', ANALYTIC_CASES)
def test_a_method_has_the_order_that_it_declares(system, method):
    # One for all: methods must also agree on what they approach.
    exact = run(system, 'position_verlet', REFERENCE)
    found = [run(system, method, substeps) for substeps in SUBSTEPS]
    for kind in ('positions', 'velocities'):
        errors = [np.abs(state[kind] - exact[kind]).max() for state in found]
        slopes = -np.diff(np.log2(errors))
        np.testing.assert_allclose(slopes, INTEGRATORS[method].order, atol=0.1, err_msg=kind)


def test_no_edge_of_a_gust_is_on_a_boundary_of_substeps():
    gust = Scene().with_parameters(GUSTS).wind.gust
    assert gust.period * 3 < SECONDS
    for number in (1, 2, 3):
        for edge in (number * gust.period, number * gust.period + gust.duration):
            for substeps in SUBSTEPS:
                ahead = edge * BASE['rate'] * substeps % 1
                assert 0.01 < ahead < 0.99
