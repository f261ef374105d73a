"""How accuracy is given up, and taken up again."""

import math

import pytest

from cloth_ros import Scene
from cloth_ros.live.overload import Overload
from cloth_ros.model.time_step import check_time_step, stability_limit, substep_length

ASKED = Scene().with_parameters(
    {
        'sheet.rows': 64,
        'sheet.columns': 64,
        'solver.tolerance': 1e-6,
        'solver.overload': 'coarsen',
    }
)


def cost(scene: Scene, load: float) -> float:
    """Return the cost of a substep, s, that makes a scene take this share of real time."""
    return load * substep_length(scene)


def test_an_overload_relaxes_the_tolerance_as_far_as_it_must():
    overload = Overload(ASKED)
    assert not overload.relax(cost(ASKED, 0.7))
    assert overload.level.scene is ASKED
    dear = cost(ASKED, 2.0)
    assert overload.relax(dear)
    level = overload.level
    assert level.spacing == 1
    assert dear / substep_length(level.scene) <= 0.65
    assert level.scene.solver.tolerance > ASKED.solver.tolerance
    assert 'tolerance relaxed' in level.text
    # It changes nothing else.
    back = level.scene.with_parameters({'solver.tolerance': ASKED.solver.tolerance})
    assert back == ASKED


def test_then_the_grid_is_coarsened_as_far_as_it_must():
    overload = Overload(ASKED)
    limit = stability_limit(ASKED)
    dear = 1.5 * limit  # at the stability limit 1.5 times too slow
    assert overload.relax(dear)
    assert overload.level.spacing == 2
    assert overload.level.particles < 0.3 * 64**2
    assert overload.level.substep > 1.5 * limit
    assert 'grid 2 times coarser' in overload.level.text


def test_it_ends_with_a_grid_of_a_few_particles():
    overload = Overload(ASKED)
    assert overload.relax(1e3)
    assert 3 <= overload.level.particles**0.5 < 6
    assert not overload.relax(1e3)


def test_accuracy_is_taken_up_again_when_the_machine_can_follow():
    overload = Overload(ASKED)
    dear = cost(ASKED, 8.0)
    overload.relax(dear)
    assert not overload.recover(dear)
    while overload.depth:
        assert overload.recover(0.0)
    assert overload.level.scene is ASKED
    assert not overload.recover(0.0)


@pytest.mark.parametrize(
    'changes',
    [
        {'solver.overload': 'slow_motion'},
        {'sheet.rows': 1, 'sheet.columns': 2, 'solver.tolerance': 1.0},
    ],
)
def test_where_there_is_nothing_to_give_up_nothing_changes(changes):
    scene = ASKED.with_parameters(changes)
    overload = Overload(scene)
    assert not overload.relax(1.0)
    assert overload.level.scene is scene


@pytest.mark.parametrize('pins', [[':,:'], ['::2,::2', '1::2,1::2'], ['::3,:']])
def test_many_pins_do_not_hinder_it(pins):
    scene = ASKED.with_parameters({'sheet.rows': 128, 'sheet.columns': 128, 'pins': pins})
    overload = Overload(scene)
    assert overload.level.scene is scene
    assert overload.relax(1e3)
    assert overload.level.particles < 36


def test_a_fixed_number_of_substeps_is_given_up_as_well():
    overload = Overload(ASKED.with_parameters({'solver.substeps': 5000}))
    assert overload.relax(1.0)
    assert overload.level.scene.solver.substeps == 0


def test_levels_that_would_take_too_many_substeps_are_left_out():
    """With a tolerance as small as this, such a sheet is accepted with fixed substeps only."""
    scene = ASKED.with_parameters(
        {
            'rate': 1.0,
            'sheet.size': [1000.0, 1000.0],
            'sheet.mass': 1e-3,
            'springs.structural': 1e4,
            'solver.tolerance': 1.0,
        }
    )
    least = math.ceil(1 / (scene.rate * 0.9 * stability_limit(scene)))
    scene = scene.with_parameters({'solver.substeps': least, 'solver.tolerance': 1e-6})
    with pytest.raises(ValueError, match=r'solver\.tolerance'):
        check_time_step(scene.with_parameters({'solver.substeps': 0}))
    overload = Overload(scene)
    assert overload.level.scene is scene
    assert overload.relax(1e3)
    assert overload.level.spacing > 1
