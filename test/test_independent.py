"""The cloth beside an independent solution of the same equations, by SciPy's DOP853."""

import numpy as np
import pytest
from reference import Equations
from scipy.integrate import solve_ivp

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators import INTEGRATORS

SECONDS = 0.2
WIND = (0.5, 2.0, -1.0)

# Sheets of different shape, with all kinds of forces that are smooth.
ANALYTIC_CASES = {
    'structural springs': {'springs.shear': 0.0, 'springs.bending': 0.0},
    'the defaults': {},
    'dashpots and drag': {'springs.damping': 0.02, 'drag': 2.0},
    'no bending, oblong': {'sheet.size': [0.6, 1.4], 'springs.bending': 0.0},
    'a strip': {'sheet.rows': 2, 'sheet.columns': 8, 'pins': [':,0']},
    'a chain': {'sheet.rows': 1, 'sheet.columns': 7, 'pins': ['0,0']},
    'light in the wind': {'sheet.mass': 0.06, 'wind.velocity': WIND, 'springs.structural': 50.0},
    'nothing pinned': {'pins': [''], 'wind.velocity': WIND},
}


def swinging(system: str, **changes: object) -> Cloth:
    """Return a cloth that is bulged and moves, so that every force acts from the start."""
    base = {'sheet.rows': 4, 'sheet.columns': 5, 'solver.precision': 'double'}
    cloth = Cloth(Scene().with_parameters({**base, **ANALYTIC_CASES[system], **changes}))
    generator = np.random.default_rng(sorted(ANALYTIC_CASES).index(system))
    start = cloth.positions
    free = ~cloth.scene.pinned()[..., None]
    cloth.positions = start + free * generator.normal(0, 0.02, start.shape)
    cloth.velocities = free * generator.normal(0, 0.5, start.shape)
    return cloth


def independent(cloth: Cloth) -> np.ndarray:
    """Return where the particles of a cloth are after `SECONDS`, by another program."""
    equations, shape = Equations(cloth.scene), (2, *cloth.positions.shape)
    wind = np.array(cloth.scene.wind.velocity)

    def rates(_: float, flat: np.ndarray) -> np.ndarray:
        p, v = flat.reshape(shape)
        return np.stack([v, equations.acceleration(p, v, wind)]).ravel()

    start = np.stack([cloth.positions, cloth.velocities]).ravel()
    solution = solve_ivp(rates, (0, SECONDS), start, method='DOP853', rtol=1e-10, atol=1e-12)
    assert solution.success
    return solution.y[:, -1].reshape(shape)[0]


@pytest.mark.parametrize('system', ANALYTIC_CASES)
def test_an_independent_solution_agrees_to_a_micrometre(system):
    expected = independent(swinging(system))
    for method, kind in INTEGRATORS.items():
        substeps = 2000
        coarse, fine = (
            swinging(system, **{'solver.method': method, 'solver.substeps': n})
            for n in (substeps, 2 * substeps)
        )
        for cloth in (coarse, fine):
            cloth.advance(SECONDS)
        found = fine.positions
        if kind.order == 1:
            # Its error, in proportion to the step, would need millions of steps.
            found = 2 * found - coarse.positions
        error = np.linalg.norm(found - expected, axis=-1).max()
        assert error < 1e-6, f'{method}: {error:.1e} m'
