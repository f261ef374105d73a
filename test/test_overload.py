"""How accuracy is given up, and taken up again."""

import pytest

from cloth_ros import Scene
from cloth_ros.model.substeps import substep_length
from cloth_ros.node.overload import Overload

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
    assert overload.scene is ASKED
    dear = cost(ASKED, 2.0)
    assert overload.relax(dear)
    assert dear / substep_length(overload.scene) <= 0.65
    assert overload.scene.solver.tolerance > ASKED.solver.tolerance
    assert 'tolerance relaxed' in str(overload)
    # It changes nothing else.
    back = overload.scene.with_parameters({'solver.tolerance': ASKED.solver.tolerance})
    assert back == ASKED


def test_it_ends_at_the_stability_limit():
    overload = Overload(ASKED)
    assert overload.relax(1.0)
    limit = ASKED.stability_limit()
    assert 0.8 * limit < substep_length(overload.scene) < limit
    assert not overload.relax(1.0)


def test_accuracy_is_taken_up_again_when_the_machine_can_follow():
    overload = Overload(ASKED)
    dear = cost(ASKED, 8.0)
    overload.relax(dear)
    assert not overload.recover(dear)
    while overload.level:
        assert overload.recover(cost(ASKED, 0.1))
    assert overload.scene is ASKED
    assert not overload.recover(0.0)


@pytest.mark.parametrize(
    'changes', [{'solver.overload': 'slow_motion'}, {'solver.tolerance': 1.0}]
)
def test_where_there_is_nothing_to_give_up_nothing_changes(changes):
    scene = ASKED.with_parameters(changes)
    overload = Overload(scene)
    assert not overload.relax(1.0)
    assert overload.scene is scene


def test_a_fixed_number_of_substeps_is_given_up_as_well():
    overload = Overload(ASKED.with_parameters({'solver.substeps': 5000}))
    assert overload.relax(1.0)
    assert overload.scene.solver.substeps == 0
