import pytest

from cloth_ros import Scene
from cloth_ros.model import simulation
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.tradeoff.energy_budget import AccountedCloth

TICK = 1 / 60


def account(scene: Scene, ticks: int, goal=None) -> AccountedCloth:
    cloth = AccountedCloth(scene)
    for number in range(ticks):
        if goal is not None:
            cloth.move_sphere((0.0, 0.0, 1.5 + (goal - 1.5) * min((number + 1) / 18, 1)))
        cloth.advance(TICK)
    return cloth


@pytest.mark.parametrize('config', ['hanging', 'gust', 'drop_on_sphere', 'small_fast_sphere'])
def test_the_budget_of_every_ready_scene_closes(config):
    scene = Scene.from_yaml(f'config/{config}.yaml')
    if scene.wind.gust.period > 0:
        scene = scene.with_parameters({'wind.gust.period': 0.5, 'wind.gust.duration': 0.3})
    goal = 0.6 if config == 'small_fast_sphere' else None
    budget = account(scene, 60, goal).budget()
    assert budget.turnover > 1e-3
    assert budget.closure < 0.01
    assert budget.drag < 0
    touched = config in ('drop_on_sphere', 'small_fast_sphere')
    assert (budget.contact != 0) == touched


@pytest.mark.parametrize('method', INTEGRATORS)
def test_dashpots_and_drag_take_what_is_booked_to_them(method):
    scene = Scene().with_parameters(
        {
            'sheet.rows': 10,
            'sheet.columns': 10,
            'springs.damping': 0.01,
            'wind.air_density': 0.0,
            'solver.method': method,
            'solver.precision': 'double',
            'solver.tolerance': 1e-4,
        }
    )
    budget = account(scene, 60).budget()
    assert budget.dashpots < 0
    assert budget.drag < 0
    assert budget.air == pytest.approx(0, abs=1e-12)
    assert budget.contact == 0
    assert budget.closure < 0.01


def test_a_gain_of_energy_is_not_explained_away():
    """Positions that someone shifts by hand are work that no force has done."""
    cloth = account(Scene().with_parameters({'sheet.rows': 8, 'sheet.columns': 8}), 10)
    cloth.positions = cloth.positions + (0.0, 0.0, 0.3) * ~cloth.scene.pinned()[..., None]
    cloth.advance(TICK)
    assert cloth.budget().closure > 0.1


@pytest.mark.parametrize(
    'fault', ['drag', 'wind.drag_coefficient', 'gravity', 'springs.structural']
)
def test_forces_that_are_not_by_their_laws_stay_unexplained(fault, monkeypatch):
    def faulty(scene, *others):
        value = scene.flat()[fault]
        wrong = [1.5 * each for each in value] if fault == 'gravity' else 1.5 * value
        return KickDrift(scene.with_parameters({fault: wrong}), *others)

    soft = {'springs.structural': 4.0, 'springs.shear': 2.0, 'springs.bending': 0.4, 'drag': 2.0}
    scene = Scene().with_parameters({'sheet.rows': 10, 'sheet.columns': 10, **soft})
    assert account(scene, 30).budget().closure < 0.001
    monkeypatch.setattr(simulation, 'Dynamics', faulty)
    assert account(scene, 30).budget().closure > 0.01
