"""Dashpots: the stages of their impulses, and the cloth that they damp."""

import math

import numpy as np
import pytest
from builders import SPRINGS_ONLY, cloth_of, crumple, examples, momentum, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.integrators import kick_drift_kernel as kernel
from cloth_ros.model.integrators.dashpot_stages import MOST, REACH, stages, stages_for
from cloth_ros.model.integrators.integrator import Step
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.model.stability import rate_bounds
from cloth_ros.tradeoff.tangent_stiffness import TangentStiffness

DOUBLE = {'solver__precision': 'double'}


@given(st.integers(2, MOST), st.floats(0.0, 1.0))
def test_stages_of_any_number_damp_up_to_their_reach(count, share):
    chosen = stages(count)
    assert 0.3 < chosen.factor(share * chosen.reach) <= 1
    # Nowhere is there a velocity that is hardly damped, but for slow ones.
    if share * chosen.reach > 0.1:
        assert chosen.factor(share * chosen.reach) < 0.93
    assert abs(chosen.factor(1.5 * chosen.reach)) > 1


@pytest.mark.parametrize('count', [2, 3, 5, MOST])
def test_stages_are_of_second_order(count):
    z = np.array([0.02, 0.04, 0.08])
    errors = [abs(stages(count).factor(each) - math.exp(-each)) for each in z]
    np.testing.assert_allclose(np.diff(np.log2(errors)), 3, atol=0.15)


@given(st.floats(0.0, REACH))
def test_as_few_stages_as_possible_are_chosen(product):
    count = len(stages_for(product).stages)
    assert stages(count).reach >= product * (1 - 1e-12)
    assert count == 2 or stages(count - 1).reach < product


@examples(0.2)
@given(
    seed=st.integers(0, 2**31),
    product=st.floats(0.1, 0.99 * REACH),
    pins=st.sampled_from([[''], ['0,0', '0,-1']]),
)
def test_an_impulse_is_the_polynomial_of_the_matrix_of_the_dashpots(seed, product, pins):
    """And so it takes neither momentum nor the velocity of the whole from a free sheet."""
    cloth = crumple(
        small_cloth(**{**SPRINGS_ONLY, **DOUBLE, 'pins': pins, 'springs__damping': 0.1}),
        0.1,
        seed,
        speed=1.0,
    )
    state, scene = cloth._simulation.state, cloth.scene
    _, viscous = rate_bounds(scene)
    seconds = product / viscous
    free, tangent = ~scene.pinned(), TangentStiffness(scene, state.world_positions)
    root = np.sqrt(state.grid.tributary_areas)
    before = root * state.velocities
    start = momentum(cloth)
    values, vectors = np.linalg.eigh(tangent.damping.toarray())
    chosen = stages_for(product)
    factors = np.array([chosen.factor(seconds * value) for value in values])
    expected = vectors @ (factors * (vectors.T @ before[:, free].ravel()))
    # Without the springs: those change velocities as well.
    kick_drift = KickDrift(scene, state.grid, np.float64, separate=True)
    for row in kick_drift.operations(Step(seconds, 0.0, 1)):
        kick_drift.run(state, np.array([row]), (0.0, 0.0, 0.0))
        if row[0] == kernel.ACCELERATE:
            state.acceleration[...] = 0
    found = (root * state.velocities)[:, free].ravel()
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(before).max())
    if pins == ['']:
        np.testing.assert_allclose(momentum(cloth), start, rtol=0, atol=1e-13)


@pytest.mark.parametrize('damping', [1e-3, 0.05])
def test_impulses_of_the_dashpots_leave_a_draped_sheet_at_rest(damping):
    """Gravity and contact change the velocity of what lies on the box in every substep."""
    cloth = cloth_of(
        sheet={'rows': 24, 'columns': 24, 'size': (0.5, 0.5), 'position': (0, 0, 0.2)},
        pins=[''],
        drag=2.0,
        springs__damping=damping,
        collider={
            'names': ['box'],
            'box': {'type': 'box', 'size': (0.2, 0.2, 0.2), 'position': (0, 0, 0.09)},
        },
    )
    cloth.advance(9.0)
    assert np.sqrt(np.mean(np.sum(cloth.velocities**2, axis=-1))) < 2e-4


def test_the_time_of_a_substep_is_that_with_its_dashpots(monkeypatch):
    """And nothing has moved."""
    tables, run = [], KickDrift.run
    monkeypatch.setattr(
        KickDrift,
        'run',
        lambda self, state, table, *more, **options: (
            tables.append(table),
            run(self, state, table, *more, **options),
        ),
    )
    cloth = crumple(small_cloth(springs__damping=1.0), 0.01, speed=1.0)
    before = cloth.positions.copy(), cloth.velocities.copy()
    assert cloth.time_substep() > 0
    stages = [np.count_nonzero(table[:, 0] == kernel.DAMP) for table in tables]
    assert min(stages) > 1
    assert np.array_equal(cloth.positions, before[0])
    assert np.array_equal(cloth.velocities, before[1])
