"""Stability limits of states: eigenvalues, tangent stiffness, prediction and measurement."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Scene
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.stability import SAFETY
from cloth_ros.tradeoff import measured_stability
from cloth_ros.tradeoff.eigenvalues import NotConvergedError as NotConverged
from cloth_ros.tradeoff.eigenvalues import has_eigenvalue_above, largest_eigenvalue
from cloth_ros.tradeoff.measured_stability import compare, measured_limit, states
from cloth_ros.tradeoff.reference_model import acceleration, tributary_areas
from cloth_ros.tradeoff.tangent_stiffness import TangentStiffness, stability_limit

SPRINGS_ONLY = {'gravity': [0, 0, 0], 'drag': 0.0, 'wind.air_density': 0.0}
SHEETS = {
    'undamped': {},
    'slightly damped': {'springs.damping': 0.03},
    'limited by damping': {'springs.damping': 1.0, 'sheet.size': [0.3, 1.0]},
    'stiff in bending, oblong': {'springs.bending': 5e4, 'sheet.size': [3.0, 1.0]},
    'stiff in shear': {'springs.structural': 1.0, 'springs.shear': 500.0},
    'a strip': {'sheet.rows': 2, 'springs.damping': 0.03, 'pins': ['0,0']},
}
every_integrator = pytest.mark.parametrize('method', INTEGRATORS)


def sheet(rows: int, columns: int, **parameters: object) -> Scene:
    size = {'sheet.rows': rows, 'sheet.columns': columns}
    return Scene().with_parameters({**size, **SPRINGS_ONLY, **parameters})


def limits(scene: Scene, state: str, scale: float = 1.0) -> tuple[float, float]:
    """Return the measured and the predicted limit of a state, s."""
    positions = scale * states(scene)[state]
    return measured_limit(scene, positions), stability_limit(scene, positions)


@pytest.mark.parametrize('symmetric', [True, False])
@pytest.mark.parametrize('size', [1, 3, 310])  # below and above that from which on ARPACK is used
def test_the_largest_eigenvalue_is_that_of_the_matrix(size, symmetric):
    random = np.random.default_rng(size)
    matrix = random.standard_normal((size, size))
    matrix = matrix + matrix.T if symmetric else matrix
    start, expected = random.standard_normal(size), np.linalg.eigvals(matrix).real.max()
    found = largest_eigenvalue(matrix.__matmul__, start, 1e-9, symmetric=symmetric)
    assert found.real == pytest.approx(expected, rel=1e-5)
    assert found == largest_eigenvalue(matrix.__matmul__, start, 1e-9, symmetric=symmetric)
    assert has_eigenvalue_above(matrix.__matmul__, start, expected - 0.1, 1e-6)
    assert not has_eigenvalue_above(matrix.__matmul__, start, expected + 0.1, 1e-6)
    assert largest_eigenvalue(np.zeros_like, start, 1e-6, symmetric=symmetric) == 0


def test_without_convergence_there_is_no_eigenvalue():
    def shift(x: np.ndarray) -> np.ndarray:  # nilpotent
        return np.append(x[1:], 0.0)

    start = np.random.default_rng(0).standard_normal(600)
    with pytest.raises(NotConverged):
        largest_eigenvalue(shift, start, 1e-12)
    assert not has_eigenvalue_above(shift, start, 0.5, 1e-12)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from([[''], ['0,0', '0,-1'], [':,2']]))
def test_the_tangent_is_the_derivative_of_the_forces(seed, pins):
    scene = sheet(4, 5, pins=pins, **{'springs.damping': 0.1})
    random, shape = np.random.default_rng(seed), (3, 4, 5)
    positions = np.moveaxis(states(scene)['undeformed'], -1, 0) + random.normal(0, 0.05, shape)
    free, tangent = ~scene.pinned(), TangentStiffness(scene, positions)
    field, still = random.standard_normal(shape) * free, np.zeros(shape)
    root = np.sqrt(tributary_areas(4, 5))  # of the masses
    for matrix, p, v in (
        (tangent.stiffness, 1e-6 * field, still),
        (tangent.damping, still, field),
    ):
        ahead, behind = (acceleration(scene, positions + s * p, s * v) for s in (1, -1))
        product = matrix @ (root * (p + v))[:, free].ravel()
        bound = 1e-5 * np.abs(product).max()
        change = root * (behind - ahead) / 2
        np.testing.assert_allclose(product, change[:, free].ravel(), atol=bound)
        assert abs(matrix - matrix.T).max() < 1e-9 * abs(matrix).max()


@every_integrator
@pytest.mark.parametrize('name', SHEETS)
def test_the_prediction_holds_in_every_state(name, method):
    scene = sheet(4, 5).with_parameters(SHEETS[name])
    for state in list(states(scene))[:: 1 if name.endswith('damped') else 3]:
        row = compare(scene, method, state)
        assert row.predicted == pytest.approx(row.measured, rel=0.05), row
        # Neither the limit of the state nor that of all states is too long.
        assert SAFETY * max(row.predicted, row.bound) <= row.measured, row


@every_integrator
def test_a_single_mass_is_stable_up_to_two_over_its_frequency(method):
    pinned = {'pins': ['0,0'], 'solver.method': method}
    for stiffness in (50.0, 200.0):
        scene = sheet(1, 2, **pinned, **{'springs.structural': stiffness})
        expected = 2 / math.sqrt(stiffness / (0.5 * scene.sheet.mass))
        assert limits(scene, 'undeformed') == pytest.approx((expected, expected), rel=0.01)


def test_buckling_does_not_count_as_instability():
    """A compressed sheet bulges at any substep; the limit is that of its stiff modes."""
    measured, predicted = limits(sheet(6, 7), 'undeformed', 0.6)
    assert measured == pytest.approx(predicted, rel=0.05)


def test_a_part_of_a_large_sheet_has_the_same_limit(monkeypatch):
    monkeypatch.setattr(measured_stability, '_LARGEST', 8)
    scene = sheet(13, 12)
    row = compare(scene, 'auto', 'undeformed')
    assert (row.rows, row.columns) == (8, 8)
    whole = stability_limit(scene, states(scene)['undeformed'])
    assert row.measured == pytest.approx(whole, rel=0.02)


def test_coincident_particles_and_sheets_that_cannot_move():
    scene = sheet(4, 5, **{'springs.damping': 0.1})
    loose = {f'springs.{name}': 0.0 for name in ('structural', 'shear', 'bending')}
    for changes in ({'pins': [':,:']}, loose):
        assert limits(scene.with_parameters(changes), 'crumpled') == (math.inf, math.inf)
    positions = states(scene)['crumpled'].copy()
    positions[1, 1] = positions[1, 2]
    assert 0 < stability_limit(scene, positions) < math.inf
    # No spring has a direction here, and none is stiff but for rounding.
    assert stability_limit(scene, 0 * positions) > 1
