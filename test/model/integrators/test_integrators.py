"""Integrators: stability of their amplification, and when dissipation acts."""

import math

import numpy as np
import pytest
from builders import crumple, examples, seeds, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.integrators.damped_euler import DampedEuler
from cloth_ros.model.integrators.integrator import SubstepBatch, dissipation_schedule
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.model.stability import rate_bounds


@pytest.mark.parametrize('method', INTEGRATORS)
@examples(0.5)
@given(st.floats(1e-6, 1e12), st.just(0.0) | st.floats(1e-6, 1e6))
def test_an_oscillator_grows_only_above_the_stable_step(method, elastic, viscous):
    integrator, shares = INTEGRATORS[method], np.linspace(0, 1, 6)
    # Two equal eigenvalues are found to the square root of rounding only.
    for factor, grows in ((0.999, False), (1.01, True)):
        step = factor * integrator.stable_step(elastic, viscous)
        matrices = [
            integrator.amplification(step, a * elastic, b * viscous)
            for a in shares
            for b in shares
        ]
        assert (np.abs(np.linalg.eigvals(np.stack(matrices))).max() > 1 + 1e-6) == grows


@given(st.integers(1, 60), st.integers(0, 20).map(lambda n: 2 * n + 1))
def test_dissipation_acts_in_the_middle_of_the_substeps_for_which_it_acts(count, interval):
    done, covered = 0, 0
    for undamped, weight in dissipation_schedule(count, interval):
        done += undamped + (weight > 0)
        assert weight <= interval
        if weight:
            assert weight % 2 == 1
            assert done - 1 == covered + weight // 2
            covered += weight
    assert done == covered == count


def test_dissipation_in_one_of_several_substeps_is_of_second_order():
    """Compared with dissipation in every substep, of a tenth of the length."""
    soft = {f'springs__{kind}': 2.0 for kind in ('structural', 'shear', 'bending')}
    dissipation = {'springs__damping': 0.01, 'drag': 2.0, 'wind__velocity': [1.0, 3.0, 2.0]}

    def positions(substeps: int, interval: int) -> np.ndarray:
        cloth = crumple(small_cloth(**soft, **dissipation, solver__precision='double'), 0.003)
        simulation = cloth._simulation
        steps = simulation._integrator.steps(SubstepBatch(9, 0.18 / substeps, interval))
        for _ in range(substeps // 9):
            simulation._kick_drift.apply(simulation.state, steps, cloth.wind)
        return cloth.positions

    exact = positions(9 * 400, 1)
    errors = [np.abs(positions(9 * n, 9) - exact).max() for n in (10, 20, 40)]
    np.testing.assert_allclose(-np.diff(np.log2(errors)), 2, atol=0.1)


@examples(0.2)
@given(
    seed=seeds,
    size=st.floats(0.001, 3.0),
    speed=st.floats(0.0, 100.0),
    step=st.floats(0.01, 0.9),
    drag=st.sampled_from([0.0, 0.5, 1e3, 1e6]),
    division=st.sampled_from([1, 2, 8]),
)
def test_no_step_of_damped_euler_adds_energy(seed, size, speed, step, drag, division):
    vacuum = {'wind__air_density': 0.0, 'solver__precision': 'double'}
    cloth = crumple(small_cloth(pins=['0,0'], drag=drag, **vacuum), size, seed, speed=speed)
    scene, state = cloth.scene, cloth._simulation.state
    elastic, _ = rate_bounds(scene)
    h = step / math.sqrt(elastic)
    extra_drag = DampedEuler.drag(h, elastic)
    kick_drift = KickDrift(scene, state.grid, np.float64, extra_drag=extra_drag)
    before = cloth.energy_by_kind()
    for _ in range(15):
        steps = DampedEuler.steps(SubstepBatch(1, h / division))
        kick_drift.apply(state, steps, (0.0, 0.0, 0.0))
        after = cloth.energy_by_kind()
        assert after.total <= before.total + 1e-12 * (before.motion + abs(before.gravitational))
        before = after


@given(q=st.floats(1e-6, 1.0, exclude_max=True), more=st.floats(0.0, 50.0), n=st.integers(1, 64))
def test_the_energy_gain_of_damped_euler_is_a_form_that_is_never_positive(q, more, n):
    """For substeps n times shorter than the drag was chosen for, and with more drag; h = 1."""
    rate = DampedEuler.drag(1.0, q) / n + more
    s, g, q = math.exp(-rate), -math.expm1(-rate) / rate, q / n**2
    vv, va, aa = s * s * (1 + q) - 1, s * ((1 + q) * g - 1), g * ((1 + q) * g - 2)
    assert max(np.linalg.eigvalsh([[vv, va], [va, aa]])) < 1e-12
