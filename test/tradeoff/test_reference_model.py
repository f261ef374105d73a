"""The reference implementation and the kernels beside another solver, DOP853 of SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cloth_ros import Cloth, Scene
from cloth_ros.model.forces.gusts import Gusts
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff.reference_model import ExplicitCloth, acceleration

SECONDS = 0.2
WIND = (0.5, 2.0, -1.0)
# Soft springs and substeps far below the stability limit: errors are powers of the substep.
SOFT = {'springs.structural': 5.0, 'springs.shear': 2.5, 'springs.bending': 0.5, 'rate': 50.0}
# The gusts begin and end at 0.0637 s, 0.0951 s, …, never at a multiple of a substep.
GUSTS = {'period': 0.0637, 'duration': 0.0314, 'direction': [0.3, 1.0, 0.5], 'speed': [2.0, 4.0]}
SHEETS = {
    'springs': {'wind.air_density': 0.0, 'drag': 0.0},
    'springs and dashpots': {'wind.air_density': 0.0, 'drag': 2.0, 'springs.damping': 0.02},
    'oblong, free, light, in wind': {'pins': [''], 'sheet.size': [0.6, 1.4], 'sheet.mass': 0.06},
    'a strip in gusts': {'sheet.rows': 2, **{f'wind.gust.{k}': v for k, v in GUSTS.items()}},
    'all forces': {'drag': 2.0, 'springs.damping': 0.02, 'pins': [':,0']},
    'a chain': {'sheet.rows': 1, 'springs.bending': 0.0, 'pins': ['0,0']},
}


def moving(parameters: dict[str, object]) -> Cloth:
    """Return a cloth that is bulged and moves, so that every force acts from the start."""
    base = {'sheet.rows': 4, 'sheet.columns': 5, 'wind.velocity': WIND}
    cloth = Cloth(Scene().with_parameters({**base, 'solver.precision': 'double', **parameters}))
    random, free = np.random.default_rng(0), ~cloth.scene.pinned()[..., None]
    cloth.positions = cloth.positions + free * random.normal(0, 0.02, cloth.positions.shape)
    cloth.velocities = free * random.normal(0, 0.5, cloth.positions.shape)
    return cloth


def motion(cloth: Cloth) -> np.ndarray:
    """Return positions and velocities, shape (2, 3, rows, columns)."""
    return np.moveaxis(np.stack([cloth.positions, cloth.velocities]), -1, 1)


@pytest.mark.parametrize('sheet', SHEETS)
def test_every_integrator_converges_to_the_same_motion_with_its_order(sheet):
    start = moving({**SOFT, **SHEETS[sheet]})
    scene, initial = start.scene, motion(start)
    gusts = Gusts(scene.wind.gust) if scene.wind.gust.period > 0 else None
    double, single = (acceleration(scene, *initial.astype(t), WIND) for t in (float, np.float32))
    np.testing.assert_allclose(single, double, atol=1e-4 * np.abs(double).max())
    assert single.dtype == np.float32
    # Coincident particles have no springs, and triangles without area feel no air.
    still = acceleration(scene.with_parameters({'pins': ['']}), *(0 * initial), WIND)
    assert np.array_equal(still, np.zeros_like(still) + np.reshape(scene.gravity, (3, 1, 1)))

    def rates(time: float, flat: np.ndarray) -> np.ndarray:
        p, v = flat.reshape(initial.shape)
        air = WIND if gusts is None else WIND + gusts.velocity(time)
        return np.stack([v, acceleration(scene, p, v, air)]).ravel()

    solution = solve_ivp(rates, (0, SECONDS), initial.ravel(), 'DOP853', rtol=1e-10, atol=1e-12)
    exact = solution.y[:, -1].reshape(initial.shape)
    for method, integrator in INTEGRATORS.items():
        found = []
        for substeps in (32, 64, 128):
            solver = {'solver.method': method, 'solver.substeps': substeps}
            cloth = moving({**SOFT, **SHEETS[sheet], **solver})
            cloth.advance(SECONDS)
            found.append(motion(cloth))
        errors = np.array([np.abs(state - exact).max(axis=(1, 2, 3)) for state in found])
        np.testing.assert_allclose(-np.diff(np.log2(errors), axis=0), integrator.order, atol=0.1)
        limit = found[-1] + (found[-1] - found[-2]) / (2**integrator.order - 1)
        assert np.abs(limit - exact)[0].max() < 1e-7


def test_the_explicit_simulation_is_accurate_where_stable_and_overflows_elsewhere():
    cloth = moving({'wind.gust.period': 0.05, 'wind.gust.duration': 0.03})
    stable, unstable = (
        ExplicitCloth(cloth.scene, *motion(cloth), steps_per_tick=steps) for steps in (400, 1)
    )
    stable.advance(0.1)
    cloth.advance(0.1)
    np.testing.assert_allclose(motion(cloth)[0], stable.positions, atol=2e-3)
    with np.errstate(all='ignore'):
        unstable.advance(20.0)
    assert (stable.finite, unstable.finite) == (True, False)
    # Particles inside the sphere are put on its surface.
    sphere = {'sphere.radius': 0.3, 'sphere.position': [0.0, 0.0, 1.0]}
    stable.scene = cloth.scene.with_parameters(sphere)
    stable.advance(stable.step, sphere_position=(0.0, 0.0, 0.95))
    away = stable.positions - np.reshape(stable.sphere_position, (3, 1, 1))
    assert np.linalg.norm(away, axis=0).min() == pytest.approx(0.3)
