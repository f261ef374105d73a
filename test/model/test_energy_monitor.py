"""Energy monitor: roll-backs are provoked, and do not happen where nothing is wrong."""

import math

import numpy as np
import pytest
from builders import (
    SCENE_FILES,
    SPRINGS_ONLY,
    VACUUM,
    Disturbance,
    crumple,
    overwrite,
    scene_of,
    small_cloth,
)

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators.integrator import Step
from cloth_ros.model.stability import SAFETY, rate_bounds
from cloth_ros.model.time_step import stability_limit

SMALL = scene_of(**VACUUM, sheet__rows=12, sheet__columns=12)
WEIGHTLESS = SMALL.with_parameters({'gravity': [0.0, 0.0, 0.0]})
STIFF = WEIGHTLESS.with_parameters(
    {'springs.structural': 5e4, 'springs.shear': 2.5e4, 'springs.bending': 5e3}
)


@pytest.mark.parametrize('size', [0.01, 0.1, 0.5])
@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_crumpled_cloth_gains_no_energy(size, precision):
    cloth = crumple(Cloth(STIFF.with_parameters({'solver.precision': precision})), size)
    start = cloth.energy()
    for _ in range(20):
        cloth.advance(1 / 600)
        assert cloth.energy() < 1.03 * start
    # The first batch was repeated with shorter substeps, which remain.
    assert 1 <= cloth.rollbacks.refined <= 2
    assert cloth.rollbacks.held == cloth.rollbacks.damped == cloth.rollbacks.limited == 0


def test_without_a_monitor_the_same_cloth_is_never_rolled_back_and_gains_energy():
    cloth = crumple(Cloth(STIFF, energy_monitor=None), 0.5)
    start = cloth.energy()
    cloth.advance(1 / 600)
    assert cloth.rollbacks.text == ''
    assert not cloth.energy() < 1.03 * start


@pytest.mark.parametrize('size', [0.1, 0.5])
@pytest.mark.parametrize('more', [0, 1])
def test_with_a_fixed_step_energy_oscillates_as_that_of_an_oscillator_at_most(size, more):
    """At the longest step that is accepted, φ is 0.81."""
    scene = STIFF.with_parameters({'rate': 600.0})
    substeps = math.ceil(1 / (600 * SAFETY * stability_limit(scene))) + more
    cloth = crumple(Cloth(scene.with_parameters({'solver.substeps': substeps})), size)
    phase = 0.25 * (1 / (600 * substeps)) ** 2 * rate_bounds(scene)[0]
    start = cloth.energy()
    for _ in range(100):
        cloth.advance(1 / 60)
        assert cloth.energy() < 1.01 * start / (1 - phase)


def test_a_step_that_the_user_has_fixed_is_not_divided():
    """Also where the energy oscillates by more than the tolerance of the monitor."""
    cloth = crumple(Cloth(WEIGHTLESS.with_parameters({'solver.substeps': 40})), 0.002)
    for _ in range(60):
        cloth.advance(1 / 60)
        assert cloth.substeps == 40
    assert cloth.rollbacks.text == ''


@pytest.mark.parametrize('wrong', [np.nan, np.inf, 1e30])
@pytest.mark.parametrize('times', [1, 2])
def test_a_rejected_batch_is_repeated_from_its_start(wrong, times):
    """The second time, substeps are divided already."""
    disturbance = Disturbance(overwrite('velocity', wrong), *(20, 1000)[:times])
    cloth, undisturbed = Cloth(SMALL, observer=disturbance), Cloth(SMALL)
    for each in (cloth, undisturbed):
        each.advance(0.1)
    assert cloth.rollbacks.text == f'{times} refined'
    assert cloth.time == undisturbed.time
    np.testing.assert_allclose(cloth.positions, undisturbed.positions, atol=1e-3)


def test_longer_substeps_return_after_many_accepted_batches():
    cloth = Cloth(
        SMALL.with_parameters({'drag': 0.5}),
        observer=Disturbance(overwrite('velocity', np.nan), 2),
    )
    regular = round(1 / 60 / cloth.substep)
    cloth.advance(1 / 60)
    assert cloth.substeps > 2 * regular
    for _ in range(300):
        cloth.advance(1 / 60)
    assert cloth.substeps == regular
    assert cloth.rollbacks.text == '1 refined'


def test_velocities_are_scaled_down_where_shorter_substeps_do_not_help():
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    snapshot, start, moving = cloth.snapshot(), cloth.energy(), cloth.velocities

    def push(state):
        state.velocity *= 1.5

    cloth = Cloth(SMALL, observer=Disturbance(push))
    cloth.restore(snapshot)
    cloth.advance(1e-9)
    assert cloth.rollbacks.text == '2 refined, 1 limited'
    assert cloth.energy() == pytest.approx(start, abs=1e-3 * abs(start))
    np.testing.assert_allclose(cloth.velocities, moving, rtol=1e-2, atol=1e-3)


class FailingIntegrator:
    @staticmethod
    def steps(batch):
        return (Step(math.nan, batch.h),) * batch.substeps


def test_the_damped_integrator_continues_where_nothing_else_helps(monkeypatch):
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    start, before = cloth.energy(), cloth.positions
    monkeypatch.setattr(cloth._simulation, '_integrator', FailingIntegrator)
    for n in range(1, 4):
        cloth.advance(1 / 60)
        assert cloth.rollbacks.damped >= n
        assert np.isfinite(cloth.positions).all()
        assert cloth.energy() <= start + 1e-6
    assert not np.array_equal(cloth.positions, before)
    assert cloth.rollbacks.held == 0


@pytest.mark.parametrize('fails', ['motion', 'contact'])
def test_a_cloth_is_held_for_a_batch_where_everything_fails(fails, monkeypatch):
    scene = SMALL.with_parameters({'sphere.radius': 0.1, 'sphere.position': [0.0, 0.0, 2.0]})
    observer = Disturbance(overwrite('position', math.nan)) if fails == 'motion' else None
    cloth, start = Cloth(scene, observer=observer), Cloth(scene)
    start.advance(0.3)
    cloth.restore(start.snapshot())
    if fails == 'contact':
        (sphere,) = cloth._simulation.interactions
        monkeypatch.setattr(sphere, 'act', lambda state, time, h: state.velocity.fill(np.inf))
        monkeypatch.setattr(sphere, 'may_act', lambda state, seconds: True)
    cloth.advance(1 / 60)
    assert cloth.time == pytest.approx(start.time + 1 / 60)
    assert np.array_equal(cloth.positions, start.positions)
    assert not cloth.velocities.any()
    assert cloth.rollbacks.held > 0


@pytest.mark.parametrize('path', SCENE_FILES, ids=lambda path: path.stem)
def test_nothing_is_rolled_back_in_the_scenes_of_the_package(path):
    cloth = Cloth(Scene.from_yaml(path))
    for _ in range(60):
        cloth.advance(1 / 60)
    assert np.isfinite(cloth.positions).all()
    assert cloth.rollbacks.text == ''


@pytest.mark.parametrize(('mass', 'speed'), [(0.02, 20.0), (0.005, 60.0)])
def test_nothing_is_rolled_back_in_a_storm_that_a_light_cloth_can_bear(mass, speed):
    cloth = Cloth(scene_of(sheet__mass=mass, wind__velocity=[0.0, speed, 2.0]))
    cloth.advance(2.0)
    assert cloth.rollbacks.text == ''


# Work of air and colliders, which adds to the energy that a cloth may have.


def test_work_that_is_no_number_is_rejected():
    simulation = Cloth(SMALL)._simulation
    monitor = simulation._monitor
    monitor.begin_batch(simulation.state)
    assert not monitor.accepts(simulation.state, math.nan)
    assert monitor.accepts(simulation.state, 0.0)


def test_the_work_of_the_wind_is_the_energy_gained_and_little_more():
    cloth = small_cloth(**{**SPRINGS_ONLY, 'wind__air_density': 1.2}, solver__precision='double')
    cloth.wind = (1.0, 2.0, 5.0)
    cloth.advance(0.5)
    assert cloth.energy() > 1.0
    # Where the wind slows a particle down again, its work is not subtracted.
    assert 0.999 < cloth.work / cloth.energy() < 1.2


def test_air_at_rest_does_no_work():
    cloth = small_cloth(drag=0.0)
    cloth.advance(0.5)
    assert cloth.work == 0


def test_an_abandoned_advance_leaves_no_work_behind():
    cloth = small_cloth(gravity=(0.0, 0.0, 0.0))
    cloth.wind = (0.0, 0.0, 50.0)
    steps = cloth.advance_stepwise(1.0)
    for _ in range(4):
        next(steps)
    cloth.reset()
    cloth.advance(1e-4)
    assert abs(cloth.work) < 1e-6
