"""The work of all forces adds up to the energy gained, and only if they obey their laws."""

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.tradeoff.energy_budget import Budget, WorkAccount
from cloth_ros.tradeoff.run import Scenario

CHANGES = {  # to the ready scenes: no air, dashpots and double precision; gusts soon
    'hanging': {'springs.damping': 0.01, 'wind.air_density': 0.0, 'solver.precision': 'double'},
    'gust': {'wind.gust.period': 0.2, 'wind.gust.duration': 0.1},
    'drop_on_sphere': {},
    'small_fast_sphere': {},
}
SMALL = {'sheet.rows': 10, 'sheet.columns': 10}
SOFT = {'springs.structural': 4.0, 'springs.shear': 2.0, 'springs.bending': 0.4, 'drag': 2.0}


def budget(scene: Scene, seconds: float, goal=None, raised=0.0, **fault: object) -> Budget:
    """Return the budget of a scene; with a `fault`, other parameters are simulated."""
    account = WorkAccount(scene)
    cloth = Cloth(scene.with_parameters(fault), observer=account, energy_monitor=None)
    account.open(cloth)
    for tick in Scenario(seconds, 1 / 30, goal=goal, arrival=0.3).ticks(cloth):
        cloth.advance(tick)
        if raised:
            cloth.positions = cloth.positions + (0, 0, raised) * ~scene.pinned()[..., None]
    return account.budget()


@pytest.mark.parametrize('config', CHANGES)
def test_the_budget_of_every_ready_scene_closes(config):
    scene = Scene.from_yaml(f'config/{config}.yaml')
    scene = scene.with_parameters({**SMALL, **CHANGES[config]})
    found = budget(scene, 0.6, (0.0, 0.0, 0.6) if config == 'small_fast_sphere' else None)
    assert found.as_dict()['closure'] == found.closure < 0.01
    assert found.turnover > 1e-3
    assert found.drag < 0
    assert (found.dashpots < 0) == (found.air == 0) == (config == 'hanging')
    assert (found.contact != 0) == ('sphere' in config)


@pytest.mark.parametrize(
    'fault', ['drag', 'wind.drag_coefficient', 'gravity', 'springs.structural', 'displacement']
)
def test_what_is_not_by_the_law_of_a_force_leaves_the_budget_open(fault):
    scene = Scene().with_parameters({**SMALL, **SOFT})
    assert budget(scene, 0.3).closure < 0.001
    if fault == 'displacement':
        wrong = budget(scene, 0.3, raised=0.01)
    else:
        wrong = budget(scene, 0.3, **{fault: (1.5 * np.array(scene.flat()[fault])).tolist()})
    assert wrong.closure > 0.01


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_the_work_of_strong_dashpots_is_that_of_their_stages(precision):
    strong = {'springs.damping': 1.0, 'wind.air_density': 0.0, 'drag': 0.0}
    found = budget(
        Scene().with_parameters({**SMALL, **strong, 'solver.precision': precision}), 0.3
    )
    assert found.dashpots < 0
    assert found.closure < 1e-5
