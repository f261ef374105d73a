"""What a study runs: its settings, from which state, for how long and with which inputs."""

from dataclasses import replace

import numpy as np
import pytest

from cloth_ros import Scene
from cloth_ros.model.resample import resample_scene
from cloth_ros.model.time_step import substep_length
from cloth_ros.tradeoff.cache import Cache
from cloth_ros.tradeoff.run import Scenario, simulate, state_at, touches_sphere
from cloth_ros.tradeoff.schedule import Options, Schedule, start_time
from cloth_ros.tradeoff.settings import (
    Setting,
    changed_pins,
    least_substeps,
    make_cloth,
    plan,
)

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


def test_substeps_that_follow_the_state_are_compared_with_those_that_do_not():
    """Where the state matters only: small sheets have shorter substeps for other reasons."""
    assert all(setting.follows_state for setting in plan(SMALL, quick=False))
    scene = SMALL.with_parameters({'sheet.rows': 36, 'sheet.columns': 36})
    settings = plan(scene, quick=True)
    fixed_ones = [setting for setting in settings if not setting.follows_state]
    assert {setting.tolerance for setting in fixed_ones} == {1e-2, 1e-3}
    for setting in fixed_ones[:1]:
        following = replace(setting, follows_state=True)
        assert following in settings
        counts = []
        for each in (setting, following):
            cloth = make_cloth(scene, each)
            cloth.advance(1 / 60)
            counts.append(cloth.substeps)
        assert counts[0] == round(1 / (60 * substep_length(scene)))
        assert counts[1] < counts[0]


def test_the_sphere_arrives_in_time_and_every_sample_is_taken():
    sphere = {'sphere.radius': 0.1, 'sphere.position': [0.0, 0.0, 3.0]}
    scene = SMALL.with_parameters(sphere)
    cloth = make_cloth(scene, plan(scene, quick=True)[0])
    run = simulate(cloth, Scenario(0.1, 1 / 30, goal=(0.1, 0.0, 3.2), arrival=0.05))
    assert len(run.energy) == len(run.positions) == 3
    np.testing.assert_allclose(cloth.sphere_position, (0.1, 0.0, 3.2), atol=1e-12)
    np.testing.assert_array_equal(run.positions[-1], cloth.positions)
    assert run.contact is None


def test_contact_is_found_between_particles_as_well():
    # A flat free sheet at 1 m falls on a sphere of 0.1 m below the middle of a cell.
    changes = {'pins': [''], 'drag': 0.0, 'wind.air_density': 1e-20}
    changes |= {'sphere.radius': 0.1, 'sphere.position': [0.0, 0.0, 0.75]}
    cloth = make_cloth(SMALL.with_parameters(changes), fixed(50))
    run = simulate(cloth, Scenario(0.4, 1 / 30))
    touches = np.sqrt(2 * 0.15 / 9.81)
    assert touches - 0.01 < run.contact < touches + 1 / 30 + 0.01


@pytest.mark.parametrize('sides', [(6, 6), (1, 6), (2, 1), (1, 1)])
def test_a_sheet_touches_a_sphere_wherever_between_its_particles_that_is(sides):
    sphere = {'sphere.radius': 0.01, 'sphere.position': [0.0, 0.0, 0.0]}
    sizes = {'sheet.rows': sides[0], 'sheet.columns': sides[1], 'pins': ['']}
    cloth = make_cloth(Scene().with_parameters({**sphere, **sizes}), fixed(100))
    for height, touches in ((0.01, True), (-0.01, True), (0.011, False), (0.2, False)):
        cloth.positions = 3 * cloth.positions * (1, 1, 0) + (0, 0, height)  # ever more stretched
        assert touches_sphere(cloth) == touches


def test_fixed_substeps_are_taken_stable_or_not_however_fast_the_cloth():
    substeps = round(0.7 * least_substeps(SMALL, 'position_verlet'))
    cloth = make_cloth(SMALL, fixed(substeps))
    cloth.velocities = 30.0 * np.ones(cloth.velocities.shape)
    cloth.advance(1 / 60)
    assert (cloth.substeps, cloth.substep) == (substeps, pytest.approx(1 / 60 / substeps))
    run = simulate(make_cloth(SMALL, fixed(1)), Scenario(5.0, 1 / 30), blow_up=1e3)
    assert len(run.positions) == len(run.motion) < 150  # it ends where it blows up


@pytest.mark.parametrize(
    ('period', 'begins', 'gust', 'still'),
    [
        (2.0, 1.9, 0.1, False),
        (0.05, 0.0, 0.05, False),
        (30.0, 0.0, None, True),
        (0.0, 0.0, None, False),
    ],
)
def test_a_study_starts_just_before_a_gust_that_comes_soon(period, begins, gust, still, tmp_path):
    scene = SMALL.with_parameters({'wind.gust.period': period, 'wind.gust.duration': 0.01})
    if period == 0:  # gusts that move nothing
        for without in ({'wind.gust.speed': [0.0, 0.0]}, {'wind.air_density': 0.0}):
            gusts = {'wind.gust.period': 2.0, 'wind.gust.duration': 0.01}
            assert start_time(SMALL.with_parameters({**gusts, **without})) == 0.0
    schedule = Schedule(scene, Options(quick=True, seconds=0.2), Cache(tmp_path))
    start = schedule.scenario.start
    assert (schedule.begins, schedule.still) == (pytest.approx(begins), still)
    assert schedule.gust == (None if gust is None else pytest.approx(gust))
    assert (0.0 if start is None else start.time) == pytest.approx(begins)


def test_a_scenario_is_shortened_to_the_budget_once(tmp_path, monkeypatch):
    found = []
    for budget in (0.0, 1e9):
        monkeypatch.setattr('cloth_ros.tradeoff.schedule._BUDGET', {True: budget})
        schedule = Schedule(SMALL, Options(quick=True), Cache(tmp_path))
        assert (schedule.scenario.samples, schedule.wanted) == (6, pytest.approx(1.0))
        found.append(schedule.full_cost)
    assert found[0] == found[1] > schedule.expected


def test_pins_of_another_grid_are_named_where_they_have_to_be_written_otherwise():
    for pins, factor, changed in (
        (['0,0', '0,-1'], 2.0, False),
        ([''], 0.5, False),
        (['0,::5'], 2.0, True),
        (['5,5'], 0.5, True),
    ):
        scene = SMALL.with_parameters({'pins': pins})
        other = resample_scene(scene, factor)
        assert changed_pins(scene, other) == (list(other.pins) if changed else [])
