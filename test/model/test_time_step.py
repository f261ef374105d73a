"""Choice of the substep, and scenes that are refused for it."""

import math

import numpy as np
import pytest
from builders import FixedSteps, cloth_of, examples, scene_of, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model import check_scene
from cloth_ros.model.integrators.dashpot_stages import REACH
from cloth_ros.model.step_control import AdaptiveStepControl
from cloth_ros.model.time_step import dissipation_interval


@pytest.mark.parametrize(
    ('parameters', 'parts'),
    [
        ({'solver__substeps': 3}, ['solver.substeps is 3,', '0 or at least', 'or soften']),
        (
            {'solver__substeps': 60, 'springs__structural': 50_000.0},
            ['solver.substeps is 60,', 'at 60 Hz'],
        ),
        (
            {'springs__structural': 1e8, 'sheet__mass': 1e-9},
            ['springs.structural is 100000000.0,', '1e+08 substeps a tick', 'write sheet.mass: '],
        ),
        ({'springs__damping': 1e6, 'sheet__mass': 1e-9}, ['springs.damping is 1000000.0,']),
    ],
)
def test_a_scene_with_an_unstable_step_can_be_made_but_not_simulated(parameters, parts):
    scene = scene_of(**parameters)
    assert scene.with_parameters({}) == scene
    for refuse in (check_scene, Cloth, Cloth(Scene()).configure):
        with pytest.raises(ValueError, match=r'^[^\n]* is [^\n]*$') as refusal:
            refuse(scene)
        assert all(part in str(refusal.value) for part in parts), refusal.value
    if 'at least' in str(refusal.value):  # that number is enough, and one less is not
        least = int(str(refusal.value).split('at least ')[1].split()[0])
        check_scene(scene.with_parameters({'solver.substeps': least}))
        with pytest.raises(ValueError, match=f'at least {least}'):
            check_scene(scene.with_parameters({'solver.substeps': least - 1}))


@pytest.mark.parametrize('rate', [1.0, 30.0, 60.0, 97.3, 1000.0])
def test_substeps_fill_a_tick_respect_the_limit_and_have_one_length(rate):
    cloth = small_cloth(rate=rate)
    count = 1 / rate / cloth.substep
    assert count == pytest.approx(round(count))
    assert cloth.substep < cloth.stability_limit
    for _ in range(2000 if rate == 60 else 1):
        cloth.advance(1 / rate)
        count = round(1 / rate / cloth.substep)
        assert count * cloth.substep == pytest.approx(1 / rate)
    # Times are rounded, but another length would need another table of operations.
    assert len(cloth._simulation._kick_drift._tables) < 20
    assert small_cloth(rate=rate, solver__substeps=7777).substep == 1 / rate / 7777


def test_a_tighter_tolerance_gives_a_smaller_error():
    def positions(**parameters: float) -> np.ndarray:
        cloth = cloth_of(solver__precision='double', **parameters)
        cloth.advance(0.5)
        return cloth.positions

    exact, errors = positions(solver__substeps=2000), [math.inf]
    for tolerance in (0.01, 0.001, 0.0001):
        found = positions(solver__tolerance=tolerance)
        errors.append(np.linalg.norm(found - exact, axis=-1).max())
        assert errors[-1] < 1.5 * tolerance
        assert errors[-1] <= errors[-2]


@examples(0.5)
@given(st.floats(1e-6, 0.1), st.floats(0, 1e6), st.floats(0, 1e5) | st.just(math.inf))
def test_the_interval_of_dissipation_is_odd_and_bounded(substep, viscous, airspeed):
    interval = dissipation_interval(Scene(), substep, viscous, airspeed)
    assert interval in range(1, 18, 2)
    assert interval == 1 or (interval * substep * viscous <= REACH and interval * substep <= 3e-3)


# Step control and observer, which are passed to a cloth


class Recorder:
    """Observer that records the steps, and checks the order of its calls."""

    def __init__(self) -> None:
        self.steps, self._drifted = [], False

    def after_drift(self, state, step, air_velocity):
        assert not self._drifted
        self._drifted, self.air_velocity = True, air_velocity

    def after_contact(self, state, step):
        assert self._drifted
        self._drifted = False
        self.steps.append(step)


@pytest.mark.parametrize(
    'control', [lambda scene: FixedSteps(2e-4), AdaptiveStepControl], ids=['fixed', 'adaptive']
)
def test_an_observer_receives_every_substep_of_the_step_control_and_changes_none(control):
    recorder, scene = Recorder(), scene_of(wind__air_density=0.0)
    cloth = Cloth(scene, step_control=control, observer=recorder)
    other = Cloth(scene, step_control=control)
    for each in (cloth, other):
        each.wind = (0.0, 2.0, 0.0)
        each.advance(0.02)
    kicks = [step.kick for step in recorder.steps if step.kick is not None]
    assert len(kicks) == cloth.substeps == math.ceil(0.02 / cloth.substep - 1e-6)
    np.testing.assert_allclose(kicks, 0.02 / len(kicks))
    np.testing.assert_allclose(sum(step.drift for step in recorder.steps), 0.02)
    assert recorder.air_velocity == (0.0, 2.0, 0.0)
    assert np.array_equal(cloth.positions, other.positions)


def test_a_finer_solution_divides_every_substep():
    cloth = Cloth(Scene(), step_control=lambda scene: AdaptiveStepControl(scene, division=3))
    cloth.advance(1 / 60)
    assert cloth.substeps == 3 * round(1 / 60 / cloth.substep)
    for wrong in (0, 1001, 1.5, True):
        with pytest.raises(ValueError, match=f'division is {wrong}, but must be .*1 to 1000'):
            AdaptiveStepControl(Scene(), division=wrong)
