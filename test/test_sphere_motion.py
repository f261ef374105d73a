"""Where the sphere is and goes, as it is told to."""

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.live.error_estimate import ErrorEstimator


def sheet_and_sphere(**changes) -> Cloth:
    sphere = {'sphere.radius': 0.1, 'sphere.position': [0.0, 0.0, 2.0]}
    named = {name.replace('__', '.'): value for name, value in changes.items()}
    return Cloth(Scene().with_parameters({**sphere, **named}))


def test_a_command_to_a_sphere_that_is_then_taken_away_is_forgotten():
    cloth = Cloth(Scene().with_parameters({'sphere.radius': 0.1, 'sphere.position': [0, -1, 1.0]}))
    monitor = ErrorEstimator(cloth)
    cloth.move_sphere((0.0, -0.5, 1.0))
    cloth.configure(cloth.scene.with_parameters({'sphere.radius': 0.0}))
    assert cloth.sphere_waypoints == []
    monitor.restart()
    for _ in range(4):
        monitor.observe(1 / 60)
        cloth.advance(1 / 60)
        monitor.work(1.0)


@pytest.mark.parametrize('seconds', [5e-324, 1e-160, 1e-20, 1e-9])
def test_a_sphere_too_fast_to_be_swept_appears_where_it_is_told_to(seconds):
    cloth = sheet_and_sphere(pins=[''])
    cloth.move_sphere((0.0, 0.0, 1.0))
    cloth.advance(seconds)
    assert cloth.sphere_position == (0.0, 0.0, 1.0)
    assert cloth.sphere_radius < 0.1
    cloth.advance(0.2)
    assert cloth.sphere_radius == 0.1
    assert np.linalg.norm(cloth.velocities, axis=-1).max() < 10.0
    assert cloth.sphere_depth == 0.0


def test_a_sphere_may_be_set_farther_away_than_it_can_be_commanded():
    cloth = sheet_and_sphere()
    monitor = ErrorEstimator(cloth)
    far = [5000.0, 0.0, 0.0]
    cloth.configure(cloth.scene.with_parameters({'sphere.position': far}))
    for _ in range(4):
        monitor.observe(1 / 60)
        cloth.advance(1 / 60)
        monitor.work(1.0)
    assert cloth.sphere_position == tuple(far)
    assert monitor.estimate is not None


def test_a_sphere_that_is_taken_away_and_set_elsewhere_comes_back_there():
    cloth = sheet_and_sphere()
    elsewhere = {'sphere.radius': 0.0, 'sphere.position': [0.0, 0.0, 3.0]}
    cloth.configure(cloth.scene.with_parameters(elsewhere))
    cloth.configure(cloth.scene.with_parameters({'sphere.radius': 0.2}))
    assert cloth.sphere_position == (0.0, 0.0, 3.0)


@pytest.mark.parametrize('leave', [Cloth.reset, lambda cloth: cloth.move_sphere((0, 0, 9.0))])
def test_a_depth_is_not_said_any_more_once_it_is_over(leave):
    cloth = sheet_and_sphere(pins=['0,:'], sphere__position=[0.0, -0.5, 1.5])
    cloth.move_sphere((0.0, -0.5, 1.02))
    cloth.advance(1 / 60)
    assert cloth.sphere_depth > 0.01
    leave(cloth)
    cloth.advance(1 / 60)
    assert cloth.sphere_depth == 0.0


@pytest.mark.parametrize('seconds', [0.3, 0.5, 0.7])
def test_an_advance_that_is_given_up_ends_with_a_whole_stretch(seconds):
    """Ctrl-C in a notebook, for one: the sphere was put back to where it had set out."""
    cloth = sheet_and_sphere()
    cloth.move_sphere((0.0, 0.0, -1.0))
    advance_stepwise = cloth.advance_stepwise(1.0)
    while cloth.time < seconds:
        next(advance_stepwise)
    advance_stepwise.close()
    assert seconds - 0.05 < cloth.time <= seconds + 1e-3
    assert cloth.sphere_position[2] == pytest.approx(2.0 - 3.0 * cloth.time, abs=1e-6)
    points = cloth.positions - np.array(cloth.sphere_position)
    assert np.linalg.norm(points, axis=-1).min() > 0.1 - 1e-3 - cloth.sphere_depth
    energy = cloth.energy()
    cloth.advance(1e-3)
    assert cloth.energy() == pytest.approx(energy, rel=0.05)


def test_a_given_up_advance_leaves_positions_and_velocities_of_one_time():
    cloth, other = sheet_and_sphere(), sheet_and_sphere()
    advance_stepwise = cloth.advance_stepwise(1.0)
    for _ in range(100):
        next(advance_stepwise)
    with pytest.raises(KeyboardInterrupt):
        advance_stepwise.throw(KeyboardInterrupt)
    other.advance(cloth.time)
    assert np.abs(cloth.positions - other.positions).max() < 1e-5
    assert np.abs(cloth.velocities - other.velocities).max() < 1e-3


def test_a_sphere_in_the_sheet_is_as_large_as_there_is_room_from_the_start():
    cloth = sheet_and_sphere(sphere__position=(0.0, 0.0, 1.0))
    assert cloth.sphere_radius == pytest.approx(0.0, abs=1e-3)
    cloth.advance(0.05)
    grown = cloth.sphere_radius
    assert grown > 0.01
    cloth.reset()
    assert cloth.sphere_radius < 1e-3
    cloth.positions = cloth.positions + np.array([0.0, 5.0, 5.0])
    assert cloth.sphere_radius == 0.1


def test_waypoints_that_are_none_are_refused():
    cloth = sheet_and_sphere()
    for wrong in (np.full(3, np.nan), (0.0, 0.0, 1e30), (1.0, 2.0)):
        with pytest.raises(ValueError, match='a waypoint'):
            cloth.sphere_waypoints = [wrong]
    cloth.sphere_waypoints = [(0.0, 0.0, -2.0)]
    cloth.advance(0.1)
    assert cloth.sphere_position == (0.0, 0.0, -2.0)


def test_a_state_that_is_adopted_holds_still_at_other_pins():
    free = Cloth(Scene(pins=['']))
    free.advance(0.3)
    pinned = Cloth(Scene(pins=['5,5'], sphere={'radius': 0.2, 'position': (0.0, 0.0, 1.0)}))
    pinned.adopt(free)
    before = pinned.positions[5, 5]
    pinned.advance(1e-3)
    assert np.array_equal(pinned.positions[5, 5], before)
    with pytest.raises(ValueError, match='the sheet of the other cloth is'):
        pinned.adopt(Cloth(Scene(sheet={'rows': 1, 'columns': 1})))


def test_a_sphere_that_has_no_room_at_all_says_how_deep_it_is():
    cloth = sheet_and_sphere(sphere__position=tuple(Cloth(Scene()).positions[16, 16]))
    assert cloth.sphere_radius == pytest.approx(1e-4)
    assert cloth.sphere_depth == pytest.approx(1e-4, rel=0.01)
    cloth.configure(cloth.scene.with_parameters({'springs.shear': 3.0}))
    advance_stepwise = cloth.advance_stepwise(0.1)
    next(advance_stepwise)
    advance_stepwise.close()
    assert cloth.sphere_depth == pytest.approx(1e-4, rel=0.01)
