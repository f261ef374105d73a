"""Where the sphere is and goes, as it is told to."""

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.model.error_monitor import ErrorMonitor


def sheet_and_sphere(**changes) -> Cloth:
    sphere = {'sphere.radius': 0.1, 'sphere.position': [0.0, 0.0, 2.0]}
    named = {name.replace('__', '.'): value for name, value in changes.items()}
    return Cloth(Scene().with_parameters({**sphere, **named}))


def test_a_command_to_a_sphere_that_is_then_taken_away_is_forgotten():
    cloth = Cloth(Scene().with_parameters({'sphere.radius': 0.1, 'sphere.position': [0, -1, 1.0]}))
    monitor = ErrorMonitor(cloth)
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
    monitor = ErrorMonitor(cloth)
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
