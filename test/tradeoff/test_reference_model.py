"""The reference implementation beside the kernels, and both beside another ODE solver."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff.reference_model import ExplicitCloth, acceleration

SECONDS = 0.1
WIND = (0.5, 2.0, -1.0)
SHEETS = {
    'the defaults': {},
    'oblong, dashpots and drag': {'sheet.size': [0.6, 1.4], 'springs.damping': 0.02, 'drag': 2.0},
    'a strip': {'sheet.rows': 2, 'sheet.columns': 8, 'pins': [':,0']},
    'a chain': {'sheet.rows': 1, 'sheet.columns': 7, 'pins': ['0,0'], 'springs.bending': 0.0},
    'light, free, in the wind': {'pins': [''], 'sheet.mass': 0.06, 'wind.velocity': WIND},
}


def moving(parameters: dict, **changes: object) -> Cloth:
    """Return a cloth that is bulged and moves, so that every force acts from the start."""
    base = {'sheet.rows': 4, 'sheet.columns': 5, 'solver.precision': 'double'}
    cloth = Cloth(Scene().with_parameters({**base, **parameters, **changes}))
    random, free = np.random.default_rng(0), ~cloth.scene.pinned()[..., None]
    cloth.positions = cloth.positions + free * random.normal(0, 0.02, cloth.positions.shape)
    cloth.velocities = free * random.normal(0, 0.5, cloth.positions.shape)
    return cloth


def motion(cloth: Cloth) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities, shape (3, rows, columns)."""
    return np.moveaxis(cloth.positions, -1, 0), np.moveaxis(cloth.velocities, -1, 0)


@pytest.mark.parametrize('sheet', SHEETS)
def test_another_solver_finds_the_same_motion_to_a_micrometre(sheet):
    """DOP853 of SciPy on the reference implementation, against the cloth extrapolated to h = 0."""
    start = moving(SHEETS[sheet])
    scene, shape = start.scene, (2, 3, *start.positions.shape[:2])

    def rates(_: float, flat: np.ndarray) -> np.ndarray:
        p, v = flat.reshape(shape)
        return np.stack([v, acceleration(scene, p, v, scene.wind.velocity)]).ravel()

    initial = np.stack(motion(start)).ravel()
    solution = solve_ivp(rates, (0, SECONDS), initial, method='DOP853', rtol=1e-9, atol=1e-11)
    expected = np.moveaxis(solution.y[:, -1].reshape(shape)[0], 0, -1)
    for method, integrator in INTEGRATORS.items():
        coarse, fine = (
            moving(SHEETS[sheet], **{'solver.method': method, 'solver.substeps': substeps})
            for substeps in (500, 1000)
        )
        for cloth in (coarse, fine):
            cloth.advance(SECONDS)
        found = fine.positions + (fine.positions - coarse.positions) / (2**integrator.order - 1)
        assert np.linalg.norm(found - expected, axis=-1).max() < 1e-6, method


@settings(max_examples=15, deadline=None)
@given(rows=st.integers(1, 6), columns=st.integers(1, 6), seed=st.integers(0, 2**31))
def test_single_precision_gives_the_same_accelerations_to_its_rounding(rows, columns, seed):
    sheet = {'sheet.rows': rows, 'sheet.columns': columns, 'springs.damping': 0.3}
    scene = Scene().with_parameters(sheet)
    p, v = np.random.default_rng(seed).normal(0, 0.3, (2, 3, rows, columns))
    double = acceleration(scene, p, v, WIND)
    single = acceleration(scene, p.astype(np.float32), v.astype(np.float32), WIND)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, double, atol=1e-4 * np.abs(double).max() + 1e-30)
    assert not double[:, scene.pinned()].any()


def test_coincident_particles_and_flat_triangles_exert_no_force():
    scene = Scene().with_parameters({'sheet.rows': 3, 'sheet.columns': 3, 'pins': ['']})
    p = v = np.zeros((3, 3, 3))
    gravity = np.broadcast_to(np.array(scene.gravity)[:, None, None], p.shape)
    assert np.array_equal(acceleration(scene, p, v, WIND), gravity)


def explicit(cloth: Cloth, steps_per_tick: int) -> ExplicitCloth:
    return ExplicitCloth(cloth.scene, *motion(cloth), steps_per_tick=steps_per_tick)


def test_the_explicit_simulation_agrees_where_its_step_is_stable_and_overflows_elsewhere():
    gust = {'wind.gust.period': 0.05, 'wind.gust.duration': 0.03}
    cloth = moving(gust)
    plain, unstable = explicit(cloth, 400), explicit(cloth, 1)
    plain.advance(SECONDS)
    cloth.advance(SECONDS)
    np.testing.assert_allclose(motion(cloth)[0], plain.positions, atol=2e-3)
    assert plain.finite
    assert plain.time == pytest.approx(SECONDS)
    with np.errstate(all='ignore'):
        unstable.advance(20.0)
    assert not unstable.finite


def test_the_explicit_simulation_puts_free_particles_on_the_sphere():
    sphere = {'sphere.radius': 0.3, 'sphere.position': [0.0, 0.0, 1.0], 'drag': 0.0}
    plain = ExplicitCloth(
        Scene().with_parameters({'sheet.rows': 9, 'sheet.columns': 9, **sphere}),
        *motion(Cloth(Scene(sheet={'rows': 9, 'columns': 9}))),
        steps_per_tick=100,
    )
    plain.advance(0.01, sphere_position=(0.0, 0.0, 0.95))
    assert np.allclose(plain.sphere_position, (0.0, 0.0, 0.95))
    away = np.linalg.norm(plain.positions - np.array([0, 0, 0.95])[:, None, None], axis=0)
    assert away.min() == pytest.approx(0.3)
