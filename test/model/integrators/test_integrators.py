"""Integrators: stability of their amplification, and when dissipation acts."""

import numpy as np
import pytest
from builders import crumple, examples, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.integrators.integrator import SubstepBatch, dissipation_schedule


@pytest.mark.parametrize('method', INTEGRATORS)
@examples(1)
@given(st.floats(1e-6, 1e12), st.just(0.0) | st.floats(1e-6, 1e6))
def test_no_oscillator_grows_just_below_the_stable_step_and_one_grows_above(
    method, elastic, viscous
):
    integrator = INTEGRATORS[method]
    limit = integrator.stable_step(elastic, viscous)

    def largest_growth(factor: float) -> float:
        shares = np.linspace(0, 1, 6)
        steps = [
            integrator.amplification(factor * limit, a * elastic, b * viscous)
            for a in shares
            for b in shares
        ]
        return float(np.abs(np.linalg.eigvals(np.stack(steps))).max())

    # Two equal eigenvalues are found to the square root of rounding only.
    assert largest_growth(0.999) <= 1 + 1e-6
    assert largest_growth(1.01) > 1 + 1e-6


@pytest.mark.parametrize('method', INTEGRATORS)
@given(st.integers(1, 60), st.floats(1e-6, 1e-2), st.integers(0, 8).map(lambda n: 2 * n + 1))
def test_a_batch_kicks_and_drifts_for_its_whole_duration(method, substeps, h, interval):
    steps = INTEGRATORS[method].steps(SubstepBatch(substeps, h, interval))
    kicks = [step for step in steps if step.kick is not None]
    durations = [
        sum(step.drift for step in steps),
        sum(step.kick for step in kicks),
        sum(step.kick * step.weight for step in kicks),  # of dissipation
    ]
    np.testing.assert_allclose(durations, substeps * h)


@given(st.integers(1, 60), st.integers(0, 20).map(lambda n: 2 * n + 1))
def test_dissipation_acts_for_every_substep_and_in_the_middle_of_them(substeps, interval):
    done, covered = 0, 0
    for undamped, weight in dissipation_schedule(substeps, interval):
        done += undamped + (weight > 0)
        assert weight <= interval
        if weight:
            assert weight % 2 == 1
            assert done - 1 == covered + weight // 2
            covered += weight
    assert done == covered == substeps


def test_dissipation_in_one_of_several_substeps_is_of_second_order():
    """Compared with dissipation in every substep, of a tenth of the length."""

    def positions(substeps: int, interval: int) -> np.ndarray:
        soft = {f'springs__{kind}': 2.0 for kind in ('structural', 'shear', 'bending')}
        cloth = small_cloth(
            **soft,
            springs__damping=0.01,
            drag=2.0,
            wind__velocity=[1.0, 3.0, 2.0],
            solver__precision='double',
        )
        simulation = crumple(cloth, 0.003)._simulation
        batch = SubstepBatch(9, 0.18 / substeps, interval)
        for _ in range(substeps // 9):
            steps = simulation._integrator.steps(batch)
            simulation._kick_drift.apply(simulation.state, steps, cloth.wind)
        return cloth.positions

    exact = positions(9 * 400, 1)
    errors = [np.abs(positions(9 * n, 9) - exact).max() for n in (10, 20, 40)]
    np.testing.assert_allclose(-np.diff(np.log2(errors)), 2, atol=0.1)
