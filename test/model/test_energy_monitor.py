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
from cloth_ros.model.energy_monitor import EnergyMonitor
from cloth_ros.model.integrators.integrator import Step

SMALL = scene_of(**VACUUM, sheet__rows=12, sheet__columns=12)
WEIGHTLESS = SMALL.with_parameters({'gravity': [0.0, 0.0, 0.0]})
STIFF = WEIGHTLESS.with_parameters(
    {'springs.structural': 5e4, 'springs.shear': 2.5e4, 'springs.bending': 5e3}
)


@pytest.mark.parametrize('size', [0.01, 0.1, 0.5])
@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_crumpled_cloth_gains_no_energy_with_a_monitor_only(size, precision):
    scene = STIFF.with_parameters({'solver.precision': precision})
    cloth, free = (crumple(Cloth(scene, **more), size) for more in ({}, {'energy_monitor': None}))
    start = cloth.energy()
    for _ in range(20):
        cloth.advance(1 / 600)
        assert cloth.energy() < 1.03 * start
    # The first batch is repeated with shorter substeps, which remain.
    assert cloth.rollbacks.text in ('1 refined', '2 refined')
    free.advance(1 / 600)
    assert free.rollbacks.text == ''
    assert not free.energy() < 1.03 * start


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
    """The second time, substeps are divided already.  Long ones return after many batches."""
    disturbance = Disturbance(overwrite('velocity', wrong), *(20, 1000)[:times])
    cloth, undisturbed = Cloth(SMALL, observer=disturbance), Cloth(SMALL)
    for each in (cloth, undisturbed):
        each.advance(0.1)
    assert cloth.rollbacks.text == f'{times} refined'
    assert cloth.time == undisturbed.time
    np.testing.assert_allclose(cloth.positions, undisturbed.positions, atol=1e-3)
    assert cloth.substeps > 2 * undisturbed.substeps
    if times == 1:
        cloth.advance(1.5)
        cloth.advance(1 / 60)
        assert cloth.substeps == round(1 / 60 / cloth.substep)
        assert cloth.rollbacks.text == '1 refined'


def test_velocities_are_scaled_down_where_shorter_substeps_do_not_help():
    def push(state):
        state.velocity *= 1.5

    start, cloth = Cloth(SMALL), Cloth(SMALL, observer=Disturbance(push))
    start.advance(0.3)
    cloth.restore(start.snapshot())
    cloth.advance(1e-9)
    assert cloth.rollbacks.text == '2 refined, 1 limited'
    assert cloth.energy() == pytest.approx(start.energy(), rel=1e-3)
    np.testing.assert_allclose(cloth.velocities, start.velocities, rtol=1e-2, atol=1e-3)


class FailingIntegrator:
    @staticmethod
    def steps(batch):
        return (Step(math.nan, batch.h),) * batch.substeps


@pytest.mark.parametrize('fails', ['integrator', 'motion', 'contact'])
def test_a_cloth_is_damped_or_held_for_a_batch_where_nothing_else_helps(fails, monkeypatch):
    scene = SMALL.with_parameters({'sphere.radius': 0.1, 'sphere.position': [0.0, 0.0, 2.0]})
    lose = Disturbance(overwrite('position', math.nan)) if fails == 'motion' else None
    cloth, start = Cloth(scene, observer=lose), Cloth(scene)
    start.advance(0.3)
    cloth.restore(start.snapshot())
    if fails == 'integrator':
        monkeypatch.setattr(cloth._simulation, '_integrator', FailingIntegrator)
    if fails == 'contact':
        contact = cloth._simulation.interactions.contact
        monkeypatch.setattr(contact, 'act', lambda _, state, *rest: state.velocity.fill(np.inf))
        monkeypatch.setattr(contact, 'may_act', lambda state, seconds: True)
    cloth.advance(1 / 60)
    assert cloth.time == pytest.approx(start.time + 1 / 60)
    held = fails != 'integrator'
    assert (cloth.rollbacks.held > 0) == held
    assert np.array_equal(cloth.positions, start.positions) == held
    assert cloth.velocities.any() == (not held)
    assert cloth.rollbacks.damped > 0
    assert cloth.energy() <= start.energy() + 1e-6


CALM = {path.stem: Scene.from_yaml(path) for path in SCENE_FILES} | {
    f'storm of {speed:g} m/s': scene_of(sheet__mass=mass, wind__velocity=[0.0, speed, 2.0])
    for mass, speed in ((0.02, 20.0), (0.005, 60.0))
}
# The gusts of the curtain come within the test, also on the finest grid that is live on one core.
CALM |= {
    f'gusts on {side} × {side} particles': CALM['gust'].with_parameters(
        {'sheet.rows': side, 'sheet.columns': side, 'wind.gust.period': 0.6}
        | {'wind.gust.duration': 0.3, 'wind.gust.speed': [4.0, 4.0]}
    )
    for side in (36, 128)
}


class RecordingMonitor(EnergyMonitor):
    """Energy monitor that records unexplained energy as a share of what is tolerated."""

    def __init__(self, scene: Scene, dtype: type) -> None:
        super().__init__(scene, dtype)
        self.shares: list[float] = []

    def _excess(self, end, work, tolerance):
        excess = super()._excess(end, work, tolerance)
        allowed = tolerance * self._turnover(end, work) + self._least
        self.shares.append(1.0 + excess / allowed)
        return excess


@pytest.mark.parametrize('name', CALM)
def test_nothing_is_rolled_back_in_the_scenes_of_the_package_and_in_storms(name):
    """With a wide margin: no batch has a tenth of the unexplained energy that is tolerated."""
    cloth = Cloth(CALM[name], energy_monitor=RecordingMonitor)
    for _ in range(90):
        cloth.advance(1 / 60)
    assert np.isfinite(cloth.positions).all()
    assert cloth.rollbacks.text == ''
    shares = cloth._simulation._monitor.shares
    assert max(shares) < 0.1


def test_work_that_is_no_number_is_rejected():
    simulation = Cloth(SMALL)._simulation
    monitor = simulation._monitor
    monitor.begin_batch(simulation.state)
    assert not monitor.accepts(simulation.state, math.nan)
    assert monitor.accepts(simulation.state, 0.0)


def test_the_work_of_the_wind_is_the_energy_gained_and_little_more():
    air = {**SPRINGS_ONLY, 'wind__air_density': 1.2}
    cloth, still = small_cloth(**air, solver__precision='double'), small_cloth(drag=0.0)
    cloth.wind = (1.0, 2.0, 5.0)
    for each in (cloth, still):
        each.advance(0.5)
    assert cloth.energy() > 1.0
    # Where the wind slows a particle down again, its work is not subtracted.
    assert 0.999 < cloth.work / cloth.energy() < 1.2
    assert still.work == 0


def test_an_abandoned_advance_leaves_no_work_behind():
    cloth = small_cloth(gravity=(0.0, 0.0, 0.0))
    cloth.wind = (0.0, 0.0, 50.0)
    steps = cloth.advance_stepwise(1.0)
    for _ in range(4):
        next(steps)
    cloth.reset()
    cloth.advance(1e-4)
    assert abs(cloth.work) < 1e-6
