"""The work of all forces adds up to the energy gained, and only if they obey their laws."""

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff.energy_budget import Budget, WorkAccount
from cloth_ros.tradeoff.run import Scenario

SMALL = {'sheet.rows': 10, 'sheet.columns': 10}


def budget(scene: Scene, seconds: float, goal=None, **fault: object) -> Budget:
    """Return the budget of a scene; with a `fault`, other parameters are simulated."""
    account = WorkAccount(scene)
    cloth = Cloth(scene.with_parameters(fault), observer=account, energy_monitor=None)
    account.open(cloth)
    for tick in Scenario(seconds, 1 / 30, goal=goal, arrival=0.3).ticks(cloth):
        cloth.advance(tick)
    return account.budget()


@pytest.mark.parametrize('config', ['hanging', 'gust', 'drop_on_sphere', 'small_fast_sphere'])
def test_the_budget_of_every_ready_scene_closes(config):
    scene = Scene.from_yaml(f'config/{config}.yaml').with_parameters(SMALL)
    if scene.wind.gust.period > 0:
        gust = {'wind.gust.period': 0.2, 'wind.gust.duration': 0.1}
        scene = scene.with_parameters(gust)
    found = budget(scene, 0.6, (0.0, 0.0, 0.6) if config == 'small_fast_sphere' else None)
    assert found.turnover > 1e-3
    assert found.closure < 0.01
    assert found.drag < 0
    assert (found.contact != 0) == (config in ('drop_on_sphere', 'small_fast_sphere'))


@pytest.mark.parametrize('method', INTEGRATORS)
def test_dashpots_and_drag_take_energy(method):
    solver = {'solver.method': method, 'solver.precision': 'double', 'solver.tolerance': 1e-4}
    dashpots = {'springs.damping': 0.01, 'wind.air_density': 0.0}
    found = budget(Scene().with_parameters({**SMALL, **dashpots, **solver}), 0.5)
    assert found.dashpots < 0
    assert found.drag < 0
    assert (found.air, found.contact) == (0, 0)
    assert found.closure < 0.01
    assert found.as_dict()['unexplained'] == found.unexplained


@pytest.mark.parametrize(
    'fault', ['drag', 'wind.drag_coefficient', 'gravity', 'springs.structural']
)
def test_forces_that_do_not_obey_their_laws_leave_the_budget_open(fault):
    soft = {'springs.structural': 4.0, 'springs.shear': 2.0, 'springs.bending': 0.4, 'drag': 2.0}
    scene = Scene().with_parameters({**SMALL, **soft})
    assert budget(scene, 0.3).closure < 0.001
    wrong = (1.5 * np.array(scene.flat()[fault])).tolist()
    assert budget(scene, 0.3, **{fault: wrong}).closure > 0.01


def test_a_displacement_by_no_force_leaves_the_budget_open():
    scene = Scene().with_parameters(SMALL)
    account = WorkAccount(scene)
    cloth = Cloth(scene, observer=account, energy_monitor=None)
    account.open(cloth)
    cloth.advance(0.1)
    assert account.budget().closure < 0.01
    cloth.positions = cloth.positions + (0.0, 0.0, 0.3) * ~scene.pinned()[..., None]
    cloth.advance(0.1)
    assert account.budget().closure > 0.1
