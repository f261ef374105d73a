"""What a study runs: its settings, from which state, for how long and with which inputs."""

import numpy as np
import pytest

from cloth_ros import Scene
from cloth_ros.tradeoff.cache import Cache
from cloth_ros.tradeoff.run import Scenario, simulate, state_at
from cloth_ros.tradeoff.schedule import Options, Schedule
from cloth_ros.tradeoff.settings import Setting, least_substeps, make_cloth, plan

SMALL = Scene().with_parameters({'sheet.rows': 6, 'sheet.columns': 6})


def fixed(substeps: int) -> Setting:
    return Setting('position_verlet', 'double', substeps, 1e-3, 60.0)


def test_every_setting_starts_from_the_same_state():
    start, settings = state_at(SMALL, 0.1), plan(SMALL, quick=False)
    assert len(set(settings)) == len(settings)
    expected = np.moveaxis(start.grid.interior(start.position), 0, -1) + start.origin
    for setting in settings[::5]:
        cloth = make_cloth(SMALL, setting)
        next(Scenario(0.1, 1 / 30, start).ticks(cloth))
        np.testing.assert_allclose(cloth.positions, expected, atol=1e-6)
        assert cloth.time == start.time


def test_the_sphere_arrives_in_time_and_every_sample_is_taken():
    sphere = {'sphere.radius': 0.1, 'sphere.position': [0.0, 0.0, 3.0]}
    scene = SMALL.with_parameters(sphere)
    cloth = make_cloth(scene, plan(scene, quick=True)[0])
    run = simulate(cloth, Scenario(0.1, 1 / 30, goal=(0.1, 0.0, 3.2), arrival=0.05))
    assert len(run.energy) == len(run.positions) == 3
    np.testing.assert_allclose(cloth.sphere_position, (0.1, 0.0, 3.2), atol=1e-12)
    np.testing.assert_array_equal(run.positions[-1], cloth.positions)


def test_fixed_substeps_are_taken_stable_or_not_however_fast_the_cloth():
    substeps = round(0.7 * least_substeps(SMALL, 'position_verlet'))
    cloth = make_cloth(SMALL, fixed(substeps))
    cloth.velocities = 30.0 * np.ones(cloth.velocities.shape)
    cloth.advance(1 / 60)
    assert (cloth.substeps, cloth.substep) == (substeps, pytest.approx(1 / 60 / substeps))
    run = simulate(make_cloth(SMALL, fixed(1)), Scenario(5.0, 1 / 30), blow_up=1e3)
    assert len(run.positions) == len(run.motion) < 150  # it ends where it blows up


@pytest.mark.parametrize(
    ('period', 'begins', 'still'), [(2.0, 1.9, False), (0.05, 0.0, False), (30.0, 0.0, True)]
)
def test_a_study_starts_just_before_a_gust_that_comes_soon(period, begins, still, tmp_path):
    scene = SMALL.with_parameters({'wind.gust.period': period, 'wind.gust.duration': 0.01})
    schedule = Schedule(scene, Options(quick=True, seconds=0.1), Cache(tmp_path))
    start = schedule.scenario.start
    assert (schedule.begins, schedule.still) == (pytest.approx(begins), still)
    assert (0.0 if start is None else start.time) == pytest.approx(begins)


def test_a_scenario_is_shortened_to_the_budget_once(tmp_path, monkeypatch):
    for budget in (0.0, 1e9):
        monkeypatch.setattr('cloth_ros.tradeoff.schedule._BUDGET', {True: budget})
        assert Schedule(SMALL, Options(quick=True), Cache(tmp_path)).scenario.samples == 6
