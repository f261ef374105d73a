"""Levels of reduced accuracy, chosen by injected costs of a substep."""

import math

import pytest
from builders import examples, scene_of
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Scene
from cloth_ros.live.coarse_cloth import simulated_scene
from cloth_ros.live.overload import Overload
from cloth_ros.model.time_step import check_time_step, stability_limit, usual_substep

REQUESTED = scene_of(
    sheet__rows=64, sheet__columns=64, solver__tolerance=1e-6, solver__overload='coarsen'
)


def requested(**changes: object) -> Scene:
    named = {name.replace('__', '.'): value for name, value in changes.items()}
    return REQUESTED.with_parameters(named)


def load(overload: Overload, cost: float) -> float:
    """Share of real time if a substep of the level costs so much, s."""
    level = overload.level
    simulated = simulated_scene(level.scene, level.spacing)
    assert level.particles == simulated.sheet.rows * simulated.sheet.columns
    assert level.substep == usual_substep(simulated)
    return cost / level.substep


@examples(0.2)
@given(
    load_now=st.floats(-1.0, 6.0).map(lambda exponent: 10**exponent),
    pins=st.sampled_from([['0,:'], [''], [':,:'], ['::2,::2', '1::2,1::2'], ['::3,:']]),
    side=st.sampled_from([64, 128]),
    substeps=st.sampled_from([0, 5000]),
)
def test_the_finest_level_that_is_fast_enough_is_chosen(load_now, pins, side, substeps):
    """Also with many pins, and where the number of substeps is fixed."""
    scene = requested(sheet__rows=side, sheet__columns=side, pins=pins, solver__substeps=substeps)
    overload = Overload(scene)
    assert overload.level.scene is scene
    cost = load_now * usual_substep(scene)
    assert overload.relax(cost) == (load_now > 0.75)
    level, per_particle = overload.level, cost / side**2
    if overload.depth:
        assert level.particles < 36 or load(overload, per_particle * level.particles) <= 0.65
        # Nothing else is changed.
        kept = {'solver.tolerance': 1e-6, 'solver.substeps': substeps}
        assert level.scene.with_parameters(kept) == scene
        assert level.scene.solver.substeps == 0
    assert ('coarser' in level.text) == (level.spacing > 1)
    # A finer level would have been too slow; where the machine is fast enough, each returns.
    assert not overload.relax(min(per_particle * level.particles, 0.7 * level.substep))
    if overload.depth and level.particles > 36 and cost > 1e-4:
        assert not overload.recover(per_particle * level.particles)
    for depth in range(overload.depth, 0, -1):
        assert overload.depth == depth
        assert overload.recover(0.0)
    assert overload.level.scene is scene
    assert not overload.recover(0.0)


def test_the_tolerance_is_relaxed_before_the_grid_is_coarsened_to_a_few_particles():
    overload, texts = Overload(REQUESTED), []
    limit = stability_limit(REQUESTED)
    for cost in (2.0 * usual_substep(REQUESTED), 1.5 * limit, 1e3):
        assert overload.relax(cost)
        texts.append(overload.level.text)
        if overload.level.spacing == 2:
            assert overload.level.substep > 1.5 * limit
            assert overload.level.particles < 0.3 * 64**2
    assert 'tolerance relaxed to' in texts[0]
    assert texts[1:] == ['grid 2 times coarser', 'grid 32 times coarser']
    assert 3 <= overload.level.particles**0.5 < 6
    assert not overload.relax(1e3)


@pytest.mark.parametrize(
    'changes',
    [
        {'solver__overload': 'slow_motion'},
        {'sheet__rows': 1, 'sheet__columns': 2, 'solver__tolerance': 1.0},
    ],
)
def test_where_nothing_can_be_reduced_nothing_changes(changes):
    scene = requested(**changes)
    overload = Overload(scene)
    assert not overload.relax(1.0)
    assert overload.level.scene is scene


def test_levels_that_would_take_too_many_substeps_are_left_out():
    """With a tolerance as small as this, such a sheet is accepted with fixed substeps only."""
    scene = requested(
        rate=1.0,
        sheet__size=[1000.0, 1000.0],
        sheet__mass=1e-3,
        springs__structural=1e4,
        solver__tolerance=1.0,
    )
    least = math.ceil(1 / (scene.rate * 0.9 * stability_limit(scene)))
    scene = scene.with_parameters({'solver.substeps': least, 'solver.tolerance': 1e-6})
    with pytest.raises(ValueError, match=r'solver\.tolerance'):
        check_time_step(scene.with_parameters({'solver.substeps': 0}))
    overload = Overload(scene)
    assert overload.level.scene is scene
    assert overload.relax(1e3)
    assert overload.level.spacing > 1
