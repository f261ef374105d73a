"""The integrator of last resort: total energy cannot grow, in any state."""

import math

import numpy as np
from builders import crumple, examples, seeds, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.integrators.damped_euler import DampedEuler
from cloth_ros.model.integrators.integrator import SubstepBatch
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.model.stability import rate_bounds


@examples(0.4)
@given(
    seed=seeds,
    size=st.floats(0.001, 3.0),
    speed=st.floats(0.0, 100.0),
    step=st.floats(0.01, 0.9),
    drag=st.sampled_from([0.0, 0.5, 1e3, 1e6]),
    division=st.sampled_from([1, 2, 8]),
)
def test_no_step_adds_energy(seed, size, speed, step, drag, division):
    cloth = small_cloth(pins=['0,0'], drag=drag, wind__air_density=0.0, solver__precision='double')
    crumple(cloth, size, seed, speed=speed)
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
def test_the_quadratic_form_of_its_energy_gain_is_never_positive(q, more, n):
    """For substeps n times shorter than the drag was chosen for, and with more drag; h = 1."""
    rate = -0.5 * math.log1p(-q) / n + more
    s, g, q = math.exp(-rate), -math.expm1(-rate) / rate, q / n**2
    vv, va, aa = s * s * (1 + q) - 1, s * ((1 + q) * g - 1), g * ((1 + q) * g - 2)
    assert max(np.linalg.eigvalsh([[vv, va], [va, aa]])) < 1e-12
