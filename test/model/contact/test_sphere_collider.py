"""
Contact with a sphere; `reliability/test_random_scenes.py` has more of it.

Penetration at most 0.1 mm, no energy from contact, and pins that do not move hold there for every
random scene.
"""

import math

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, ROOT, SPRINGS_ONLY, Disturbance, cloth_of, overwrite, scene_of
from geometry import ray_crossings, triangle_distances, triangles

from cloth_ros import Cloth, Scene

TOLERANCE = 1e-4 + 2e-6  # m, depth that contact leaves, and rounding in single precision


def penetration(cloth: Cloth) -> float:
    """Return the depth, m, of the deepest triangle, whichever diagonal divides the quads."""
    corners = triangles(cloth.positions, both_diagonals=True)
    return cloth.sphere_radius - triangle_distances(corners, cloth.sphere_position).min()


def sphere_cloth(radius: float, *position: float, **parameters: object) -> Cloth:
    return cloth_of(sphere__radius=radius, sphere__position=position, **parameters)


# Motion of the sheet


@pytest.mark.parametrize(
    ('speed', 'offset'),
    [(2.0, (0.003, 0.005)), (20.0, (0.0, 0.0)), (100.0, (1 / 62, 1 / 62)), (5e4, (0.0, 0.0))],
)
def test_a_sphere_smaller_than_the_spacing_does_not_pass(speed, offset):
    cloth = Cloth(Scene.from_yaml(ROOT / 'config/small_fast_sphere.yaml'))
    cloth.move_sphere((*offset, 1.5))
    cloth.advance(1e-3)
    z, ticks, end = 1.5, 0, 1.5 - max(1.0, speed / 60)
    while z > end or (ticks < 20 and speed < 1e3):
        z, ticks = max(z - speed / 60, end), ticks + 1
        cloth.move_sphere((*offset, z))
        cloth.advance(1 / 60)
        assert np.isfinite(cloth.positions).all()
        assert penetration(cloth) < TOLERANCE + 1e-7 * abs(end)
    # The sheet hangs below the sphere: a ray down meets it, a ray up does not.
    corners = triangles(cloth.positions)
    if speed < 1e3:
        assert ray_crossings(corners, cloth.sphere_position, (1e-5, 2e-5, -1)) % 2 == 1
        assert ray_crossings(corners, cloth.sphere_position, (1e-5, 2e-5, 1)) % 2 == 0
    with pytest.raises(ValueError, match=r'sphere position is .*within 1000 m of the sheet'):
        cloth.move_sphere((0, 0, -1e5))


def test_a_sphere_does_no_work_on_a_sheet_at_rest():
    sheet = {'sheet__rows': 9, 'sheet__columns': 9, 'pins': [''], 'drag': 20.0}
    cloth = sphere_cloth(0.5, 0.0, 0.0, 0.49, **sheet, sphere__friction=1.0)
    cloth.advance(2.0)
    assert np.abs(cloth.velocities).max() < 1e-3
    before = cloth.work
    cloth.advance(1.0)
    assert cloth.work - before < 1e-5  # J


@pytest.mark.parametrize(
    ('size', 'pins', 'radius', 'start', 'end', 'speed'),
    [
        (12, ['0,:', '-1,:'], 0.3, (0.0, 0.0, 0.3), (0.0, 0.0, 1.5), 1.0),
        (20, ['0,:'], 0.05, (0.0, -0.45, 0.6), (0.0, -0.45, 1.6), 1.0),
        (20, ['0,0', '0,-1'], 0.1, (-1.0, -0.5, 1.0), (0.2, -0.5, 1.0), 0.5),
    ],
)
def test_nothing_is_rolled_back_where_a_slow_sphere_pushes(size, pins, radius, start, end, speed):
    cloth = sphere_cloth(radius, *start, pins=pins, sheet={'rows': size, 'columns': size})
    cloth.move_sphere(end)
    cloth.advance(float(np.linalg.norm(np.subtract(end, start))) / speed)
    cloth.advance(1.0)
    assert cloth.rollbacks.text == ''


def test_a_sphere_pressed_on_pins_shakes_nothing_and_reports_its_penetration():
    sheet = {'rows': 12, 'columns': 12}
    cloth = sphere_cloth(0.1, 0.0, -0.5, 1.5, drag=2.0, pins=['0,:'], sheet=sheet)
    for position in ((0.0, -0.5, 1.02), (0.0, -0.45, 0.98)):
        cloth.move_sphere(position)
        cloth.advance(0.1)
    cloth.configure(cloth.scene.with_parameters({'springs.bending': 51.0}))
    cloth.advance(1e-3)
    assert cloth.sphere_radius == 0.1  # whatever changes, it does not start to grow
    cloth.advance(10.0)
    assert 0.01 < cloth.sphere_depth == cloth.colliders['sphere'].max_penetration <= 0.1
    assert np.sqrt(np.mean(cloth.velocities**2)) < 0.2  # m/s
    assert cloth.rollbacks.held == 0
    cloth.move_sphere((0, 0, 9.0))
    cloth.advance(1 / 60)
    assert cloth.sphere_depth == 0.0


# A sphere that is placed inside the sheet


@pytest.mark.parametrize('roll_back', [False, True])
@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_sphere_placed_in_the_sheet_grows_and_throws_nothing(precision, roll_back):
    place = {'sphere__radius': 0.3, 'sphere__position': [0.01, 0.02, 1.03]}
    disturbance = Disturbance(overwrite('velocity', math.nan), *([30] if roll_back else [10**9]))
    cloth = Cloth(scene_of(**place, solver__precision=precision), observer=disturbance)
    start = cloth.sphere_radius
    assert 0 < start < 0.031
    cloth.advance(0.01)
    assert cloth.rollbacks.refined == roll_back
    assert cloth.sphere_radius == pytest.approx(start + 0.005, abs=2e-4)
    cloth.configure(cloth.scene.with_parameters({'springs.bending': 51.0}))
    assert cloth.sphere_radius == pytest.approx(start + 0.005, abs=2e-4)
    for _ in range(80):
        cloth.advance(0.01)
        assert np.linalg.norm(cloth.velocities, axis=-1).max() < 10  # m/s
        assert penetration(cloth) < TOLERANCE
    assert cloth.sphere_radius == 0.3
    assert cloth.rollbacks.refined == roll_back
    cloth.reset()
    assert cloth.sphere_radius == start
    cloth.positions = cloth.positions + np.array([0.0, 5.0, 5.0])
    assert cloth.sphere_radius == 0.3


def test_a_distant_sphere_acts_only_while_it_grows():
    cloth = sphere_cloth(0.1, 0, 0, 2.0)
    cloth.advance(0.01)
    contact, state = cloth._simulation.interactions.contact, cloth._simulation.state
    assert not contact.may_act(state, 1e-3)
    contact.colliders['sphere'].inset = 0.05
    assert contact.may_act(state, 1e-3)


def test_a_sphere_without_any_room_reports_its_penetration():
    cloth = sphere_cloth(0.1, *cloth_of().positions[16, 16])
    for _ in range(2):
        assert cloth.sphere_radius == pytest.approx(1e-4)
        assert cloth.sphere_depth == pytest.approx(1e-4, rel=0.01)
        cloth.configure(cloth.scene.with_parameters({'springs.shear': 3.0}))
        steps = cloth.advance_stepwise(0.1)
        next(steps)
        steps.close()


# Position and commands


def test_positions_commanded_between_two_advances_are_passed_in_their_order():
    """Around the edge of a sheet; the direct way leads through it."""
    held = {**SPRINGS_ONLY, **NEGLIGIBLE_AIR, 'pins': [':,0', ':,-1', '0,:', '-1,:']}
    cloth = sphere_cloth(0.05, 0, 0, 1.3, **held, sheet={'rows': 9, 'columns': 9})
    still = cloth.positions
    for corner in ((1.0, 0, 1.3), (1.0, 0, 0.7), (0, 0, 0.7)):
        cloth.move_sphere(corner)
    cloth.advance(1 / 60)
    assert cloth.sphere_position == (0, 0, 0.7)
    np.testing.assert_allclose(cloth.positions, still, atol=1e-4)
    cloth.move_sphere((0, 0, 1.3))
    cloth.advance(1 / 60)
    assert np.abs(cloth.positions - still).max() > 0.2


def test_many_positions_commanded_between_two_advances_are_passed_from_the_first_on():
    """Half a circle around the edge of a sheet; its chord leads through the sheet."""
    free = {**SPRINGS_ONLY, **NEGLIGIBLE_AIR}
    cloth = sphere_cloth(0.05, 0, 0, 2.0, **free, sheet={'rows': 9, 'columns': 9})
    still = cloth.positions
    for angle in np.linspace(0, math.pi, 1000):
        cloth.move_sphere((math.sin(angle), 0.0, 1 + math.cos(angle)))
    cloth.advance(1 / 60)
    assert cloth.sphere_position == pytest.approx((0, 0, 0))
    np.testing.assert_allclose(cloth.positions, still, atol=1e-4)


@pytest.mark.parametrize('seconds', [1e-160, 1e-20, 1e-9])
def test_a_sphere_too_fast_to_be_swept_is_placed_where_it_is_commanded_to(seconds):
    cloth = sphere_cloth(0.1, 0, 0, 2.0, pins=[''])
    cloth.move_sphere((0.0, 0.0, 1.0))
    cloth.advance(seconds)
    assert cloth.sphere_position == (0.0, 0.0, 1.0)
    assert cloth.sphere_radius < 0.1
    cloth.advance(0.2)
    assert (cloth.sphere_radius, cloth.sphere_depth) == (0.1, 0.0)
    assert np.linalg.norm(cloth.velocities, axis=-1).max() < 10.0


def test_parameters_move_remove_and_add_a_sphere():
    cloth, far = sphere_cloth(0.1, 0, 0, 2.0), (5000.0, 0.0, 0.0)  # no command reaches so far
    cloth.configure(cloth.scene.with_parameters({'sphere.position': far}))
    cloth.advance(1 / 60)
    assert cloth.sphere_position == far
    cloth.configure(cloth.scene.with_parameters({'sphere.position': (0, 0, 2.0)}))
    removed = {'sphere.radius': 0.0, 'sphere.position': [0.0, 0.0, 3.0]}
    cloth.configure(cloth.scene.with_parameters(removed))
    assert not cloth.colliders
    assert not cloth.inputs.collider_paths  # its commands are removed with it
    assert (cloth.sphere_radius, cloth.sphere_depth) == (0.0, 0.0)
    with pytest.raises(ValueError, match=r'sphere\.radius is 0\.0, but must be more than 0'):
        cloth.move_sphere((0, 0, 1))
    cloth.configure(cloth.scene.with_parameters({'sphere.radius': 0.2}))
    assert (cloth.sphere_position, cloth.sphere_radius) == ((0.0, 0.0, 3.0), 0.2)
    with pytest.raises(ValueError, match="collider is 'box', but must be one of: sphere"):
        cloth.move_collider('box', (0, 0, 1))


@pytest.mark.parametrize(('height', 'up', 'gravity'), [(0.3, 1, 0), (0.3, 0, 9.81), (1.0, 0, 0)])
def test_contact_is_possible_before_it_happens(height, up, gravity):
    """Kernels of contact are needed only then: the sphere moves, the sheet falls, it grows."""
    cloth = sphere_cloth(0.1, 0, 0, height, pins=[''], gravity=(0, 0, -gravity))
    touched = height == 1.0
    for n in range(60):
        if up:
            cloth.move_sphere((0.0, 0.0, height + (n + 1) / 60))
        possible = cloth.contact_possible(1 / 60)
        cloth.advance(1 / 60)
        touched = touched or penetration(cloth) > -1e-3
        if touched:
            break
        assert n > 2 or not possible
    assert touched
    assert possible
