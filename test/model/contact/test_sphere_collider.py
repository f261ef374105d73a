"""Contact with a sphere: nothing passes, whatever its size and speed, and it adds no energy."""

import math

import numpy as np
import pytest
from builders import (
    ROOT,
    SPRINGS_ONLY,
    Disturbance,
    cloth_of,
    examples,
    overwrite,
    precisions,
    scene_of,
    seeds,
)
from geometry import ray_crossings, triangle_distances, triangles
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene

TOLERANCE = 1e-4 + 2e-6  # m, depth that contact leaves, and rounding in single precision


def penetration(cloth: Cloth) -> float:
    """Return the depth, m, of the deepest triangle, whichever diagonal divides the quads."""
    corners = triangles(cloth.positions, both_diagonals=True)
    return cloth.sphere_radius - triangle_distances(corners, cloth.sphere_position).min()


def sphere_cloth(**parameters: object) -> Cloth:
    """Return a cloth with a small sphere above it."""
    return cloth_of(**{'sphere__radius': 0.1, 'sphere__position': [0.0, 0.0, 2.0], **parameters})


# Nothing passes


@pytest.mark.parametrize(
    ('speed', 'offset'),
    [(2.0, (0.003, 0.005)), (5.0, (0.0, 0.0)), (20.0, (1 / 62, 1 / 62)), (100.0, (0.0, 0.0))],
)
def test_a_sphere_smaller_than_the_spacing_does_not_pass(speed, offset):
    cloth = Cloth(Scene.from_yaml(ROOT / 'config/small_fast_sphere.yaml'))
    cloth.move_sphere((*offset, 1.5))
    cloth.advance(1e-3)
    z, ticks = 1.5, 0
    while z > 0.5 or ticks < 40:
        z, ticks = max(z - speed / 60, 0.5), ticks + 1
        cloth.move_sphere((*offset, z))
        cloth.advance(1 / 60)
        assert penetration(cloth) < TOLERANCE
    # The sheet hangs below the sphere: a ray down meets it, a ray up does not.
    corners = triangles(cloth.positions)
    assert ray_crossings(corners, cloth.sphere_position, (1e-5, 2e-5, -1)) % 2 == 1
    assert ray_crossings(corners, cloth.sphere_position, (1e-5, 2e-5, 1)) % 2 == 0


@examples(0.25)
@given(
    seed=seeds,
    sides=st.tuples(st.integers(3, 12), st.integers(3, 12)),
    radius=st.floats(0.002, 0.5),
    speed=st.floats(0.0, 200.0),
    pins=st.sampled_from(['', '0,0']),
    precision=precisions,
)
def test_no_triangle_ends_in_a_sphere_that_moves_through_the_sheet(
    seed, sides, radius, speed, pins, precision
):
    generator = np.random.default_rng(seed)
    start = generator.normal(size=3)
    start *= (0.75 + radius) / np.linalg.norm(start)
    cloth = cloth_of(
        **{'sheet__rows': sides[0], 'sheet__columns': sides[1], 'sheet__position': (0, 0, 0)},
        **{'sphere__radius': radius, 'sphere__position': start, 'pins': [pins]},
        solver__precision=precision,
    )
    direction = generator.normal(0, 0.2, 3) - start
    direction /= np.linalg.norm(direction)
    for n in range(1, 16):
        target = start + direction * min(speed * n / 60, 2.0)
        # A pinned particle cannot give way: keep clear of it.
        if pins and np.linalg.norm(target - cloth.positions[0, 0]) < 1.5 * radius + 0.05:
            break
        cloth.move_sphere(target)
        cloth.advance(1 / 60)
        assert np.isfinite(cloth.positions).all()
        assert penetration(cloth) < TOLERANCE


@pytest.mark.parametrize(('rows', 'columns'), [(1, 12), (12, 1)])
def test_a_chain_is_caught_between_its_particles(rows, columns):
    cloth = sphere_cloth(
        **{'sheet__rows': rows, 'sheet__columns': columns, 'pins': ['0,0', '-1,-1']},
        **{'sphere__radius': 0.02, 'sphere__position': (0, 0, 1.5)},
    )
    middle = cloth.positions.reshape(-1, 3)[5:7].mean(0)
    for z in np.linspace(1.5, 0.7, 30):
        cloth.move_sphere((middle[0], middle[1], z))
        cloth.advance(1 / 60)
        p = cloth.positions.reshape(-1, 3)
        segments = np.stack([p[:-1], p[1:], p[1:]], axis=1)
        assert triangle_distances(segments, cloth.sphere_position).min() > 0.02 - TOLERANCE
    assert cloth.positions[..., 2].min() < 0.75


def test_a_single_particle_is_pushed():
    cloth = sphere_cloth(**SPRINGS_ONLY, sheet__rows=1, sheet__columns=1)
    cloth.move_sphere((0, 0, 0.5))
    cloth.advance(0.01)
    np.testing.assert_allclose(cloth.positions[0, 0], (0, 0, 0.4), atol=TOLERANCE)


@pytest.mark.parametrize('distance', [10.0, 900.0])
def test_a_sphere_that_jumps_takes_the_sheet_along_in_bounded_time(distance):
    cloth = Cloth(Scene.from_yaml(ROOT / 'config/small_fast_sphere.yaml'))
    cloth.move_sphere((0, 0, 1.5 - distance))
    for _ in range(4):
        cloth.advance(1 / 60)
        assert np.isfinite(cloth.positions).all()
    with pytest.raises(ValueError, match=r'sphere position is .*within 1000 m of the sheet'):
        cloth.move_sphere((0, 0, -1e5))


# Friction, energy and work


def on_incline(friction: float, tilt: float) -> Cloth:
    """Return a small sheet on a sphere so large that it is a plane, in tilted gravity."""
    return cloth_of(
        sheet={'rows': 5, 'columns': 5, 'size': (0.1, 0.1), 'position': (0, 0, 1e-5)},
        pins=[''],
        sphere={'radius': 500.0, 'position': (0, 0, -500), 'friction': friction},
        drag=0.0,
        wind__air_density=0.0,
        gravity=(9.81 * math.sin(tilt), 0, -9.81 * math.cos(tilt)),
        solver__precision='double',
    )


@pytest.mark.parametrize('tilt', [0.2, 0.5])
def test_friction_is_that_of_coulomb(tilt):
    """A block on an incline: it sticks for μ > tan(tilt), else slides at g (sin − μ cos)."""
    stuck = on_incline(1.2 * math.tan(tilt), tilt)
    start = stuck.positions
    stuck.advance(0.5)
    assert np.abs(stuck.positions - start).max() < 2e-3
    friction = 0.5 * math.tan(tilt)
    sliding = on_incline(friction, tilt)
    sliding.advance(0.1)
    before = sliding.velocities[..., 0].mean()
    sliding.advance(0.2)
    found = (sliding.velocities[..., 0].mean() - before) / 0.2
    assert found == pytest.approx(9.81 * (math.sin(tilt) - friction * math.cos(tilt)), rel=0.01)


@examples(0.15)
@given(seed=seeds, friction=st.floats(0, 2))
def test_a_sphere_at_rest_adds_no_energy(seed, friction):
    cloth = cloth_of(
        **SPRINGS_ONLY,
        sheet={'rows': 8, 'columns': 8, 'position': (0, 0, 0)},
        sphere={'radius': 0.25, 'position': (0.1, 0, -0.5), 'friction': friction},
        solver__precision='double',
    )
    tangential = np.random.default_rng(seed).normal(0, 0.5, 2)
    cloth.velocities = np.broadcast_to((*tangential, -4.0), (8, 8, 3))
    energies = [cloth.energy()]
    for _ in range(40):
        cloth.advance(1 / 60)
        energies.append(cloth.energy())
    assert max(energies) < 1.02 * energies[0]
    assert energies[-1] < energies[0]  # the impact is inelastic


def test_a_sphere_does_no_work_on_a_sheet_at_rest():
    cloth = sphere_cloth(
        **{'sheet__rows': 9, 'sheet__columns': 9, 'pins': [''], 'drag': 20.0},
        **{'sphere__radius': 0.5, 'sphere__position': [0.0, 0.0, 0.49], 'sphere__friction': 1.0},
    )
    cloth.advance(1.0)
    before = cloth.work
    cloth.advance(1.0)
    assert cloth.work - before < 1e-4  # J


@pytest.mark.parametrize(
    ('size', 'pins', 'radius', 'start', 'end', 'speed'),
    [
        (12, ['0,:', '-1,:'], 0.3, (0.0, 0.0, 0.3), (0.0, 0.0, 1.5), 1.0),
        (20, ['0,:'], 0.05, (0.0, -0.45, 0.6), (0.0, -0.45, 1.6), 1.0),
        (20, ['0,0', '0,-1'], 0.1, (-1.0, -0.5, 1.0), (0.2, -0.5, 1.0), 0.5),
    ],
)
def test_nothing_is_rolled_back_where_a_slow_sphere_pushes(size, pins, radius, start, end, speed):
    cloth = sphere_cloth(
        **{'sheet__rows': size, 'sheet__columns': size, 'pins': pins},
        **{'sphere__radius': radius, 'sphere__position': start},
    )
    cloth.move_sphere(end)
    cloth.advance(float(np.linalg.norm(np.subtract(end, start))) / speed)
    cloth.advance(1.0)
    assert cloth.rollbacks.text == ''


def pressed_on_pins(**parameters: object) -> Cloth:
    """Return a cloth with a sphere that is pressed on a pinned edge."""
    cloth = sphere_cloth(
        **{'sheet__rows': 12, 'sheet__columns': 12, 'pins': ['0,:'], **parameters},
        sphere__position=[0.0, -0.5, 1.5],
    )
    for position in ((0.0, -0.5, 1.02), (0.0, -0.45, 0.98)):
        cloth.move_sphere(position)
        cloth.advance(0.1)
    return cloth


def test_a_sphere_on_a_pinned_edge_does_not_shake_the_sheet():
    cloth = pressed_on_pins(drag=2.0)
    cloth.advance(15.0)
    assert 0.01 < cloth.sphere_depth <= 0.1
    assert np.sqrt(np.mean(cloth.velocities**2)) < 0.2  # m/s
    assert cloth.rollbacks.held == 0


@pytest.mark.parametrize('leave', [Cloth.reset, lambda cloth: cloth.move_sphere((0, 0, 9.0))])
def test_a_penetration_is_reported_only_as_long_as_it_lasts(leave):
    cloth = pressed_on_pins()
    assert cloth.sphere_depth == cloth.colliders['sphere'].max_penetration > 0.01
    leave(cloth)
    cloth.advance(1 / 60)
    assert cloth.sphere_depth == 0.0


# A sphere that is placed inside the sheet


def test_a_sphere_placed_in_the_sheet_grows_and_throws_nothing():
    cloth = sphere_cloth(sphere__radius=0.3, sphere__position=[0.0, 0.0, 1.0])
    assert cloth.sphere_radius < 1e-3
    cloth.advance(0.01)
    assert cloth.sphere_radius == pytest.approx(0.01, abs=2e-4)
    cloth.configure(cloth.scene.with_parameters({'springs.bending': 51.0}))
    assert cloth.sphere_radius == pytest.approx(0.01, abs=2e-4)
    fastest = 0.0
    for _ in range(40):
        cloth.advance(0.01)
        fastest = max(fastest, float(np.linalg.norm(cloth.velocities, axis=-1).max()))
        assert penetration(cloth) < TOLERANCE
    assert cloth.sphere_radius == 0.3
    assert fastest < 10  # m/s
    assert cloth.rollbacks.text == ''
    cloth.reset()
    assert cloth.sphere_radius < 1e-3
    cloth.positions = cloth.positions + np.array([0.0, 5.0, 5.0])
    assert cloth.sphere_radius == 0.3


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_sheet_that_starts_around_a_sphere_is_pushed_out(precision):
    cloth = sphere_cloth(
        **{'pins': [''], 'gravity': (0, 0, 0), 'solver__precision': precision},
        **{'sphere__radius': 0.2, 'sphere__position': (0.01, 0.02, 1.03)},
    )
    cloth.advance(0.5)
    assert penetration(cloth) < TOLERANCE


def test_a_sphere_grows_no_faster_when_a_batch_is_rolled_back():
    scene = scene_of(sphere__radius=0.3, sphere__position=[0.0, 0.0, 1.0])
    cloth = Cloth(scene, observer=Disturbance(overwrite('velocity', math.nan), 30))
    cloth.advance(0.01)
    assert cloth.rollbacks.text == '1 refined'
    assert cloth.sphere_radius == pytest.approx(0.01, abs=2e-4)


def test_a_sphere_without_any_room_reports_its_depth():
    particle = tuple(cloth_of().positions[16, 16])
    cloth = sphere_cloth(sphere__position=particle)
    assert cloth.sphere_radius == pytest.approx(1e-4)
    assert cloth.sphere_depth == pytest.approx(1e-4, rel=0.01)
    cloth.configure(cloth.scene.with_parameters({'springs.shear': 3.0}))
    steps = cloth.advance_stepwise(0.1)
    next(steps)
    steps.close()
    assert cloth.sphere_depth == pytest.approx(1e-4, rel=0.01)


def test_a_sphere_keeps_its_size_when_another_parameter_changes():
    cloth = pressed_on_pins()
    cloth.configure(cloth.scene.with_parameters({'springs.bending': 51.0}))
    cloth.advance(1e-3)
    assert cloth.sphere_radius == 0.1


# Position and commands


def test_positions_commanded_between_two_advances_are_passed_in_their_order():
    """Around the edge of a sheet; the direct way leads through it."""
    cloth = sphere_cloth(
        **{**SPRINGS_ONLY, 'pins': [':,0', ':,-1', '0,:', '-1,:']},
        **{'sheet__rows': 9, 'sheet__columns': 9},
        **{'sphere__radius': 0.05, 'sphere__position': (0, 0, 1.3)},
    )
    still = cloth.positions
    for corner in ((1.0, 0, 1.3), (1.0, 0, 0.7), (0, 0, 0.7)):
        cloth.move_sphere(corner)
    cloth.advance(1 / 60)
    assert cloth.sphere_position == (0, 0, 0.7)
    np.testing.assert_allclose(cloth.positions, still, atol=1e-4)
    cloth.move_sphere((0, 0, 1.3))
    cloth.advance(1 / 60)
    assert np.abs(cloth.positions - still).max() > 0.2


@pytest.mark.parametrize('seconds', [5e-324, 1e-160, 1e-20, 1e-9])
def test_a_sphere_too_fast_to_be_swept_is_placed_where_it_is_commanded_to(seconds):
    cloth = sphere_cloth(pins=[''])
    cloth.move_sphere((0.0, 0.0, 1.0))
    cloth.advance(seconds)
    if cloth.sphere_position == (0.0, 0.0, 2.0):  # shorter than the resolution of time
        cloth.advance(1e-9)
    assert cloth.sphere_position == (0.0, 0.0, 1.0)
    assert cloth.sphere_radius < 0.1
    cloth.advance(0.2)
    assert cloth.sphere_radius == 0.1
    assert np.linalg.norm(cloth.velocities, axis=-1).max() < 10.0
    assert cloth.sphere_depth == 0.0


def test_a_change_of_the_position_parameter_moves_the_sphere_however_far():
    cloth, far = sphere_cloth(), (5000.0, 0.0, 0.0)
    cloth.configure(cloth.scene.with_parameters({'sphere.position': far}))
    cloth.advance(1 / 60)
    assert cloth.sphere_position == far


def test_a_sphere_that_is_removed_and_added_again_starts_at_its_parameter():
    cloth = sphere_cloth()
    cloth.move_sphere((0.0, 0.0, 1.5))
    removed = {'sphere.radius': 0.0, 'sphere.position': [0.0, 0.0, 3.0]}
    cloth.configure(cloth.scene.with_parameters(removed))
    assert not cloth.colliders
    assert not cloth.inputs.collider_paths  # its commands are gone with it
    assert (cloth.sphere_radius, cloth.sphere_depth) == (0.0, 0.0)
    cloth.configure(cloth.scene.with_parameters({'sphere.radius': 0.2}))
    assert cloth.sphere_position == (0.0, 0.0, 3.0)
    assert cloth.sphere_radius == 0.2


def test_invalid_commands_to_colliders_are_refused():
    with pytest.raises(ValueError, match=r'sphere\.radius is 0\.0, but must be more than 0'):
        cloth_of().move_sphere((0, 0, 1))
    cloth = sphere_cloth()
    with pytest.raises(ValueError, match=r'sphere position is .*nan.*three finite numbers'):
        cloth.move_sphere((0, math.nan, 1))
    with pytest.raises(ValueError, match="collider is 'box', but must be one of: sphere"):
        cloth.move_collider('box', (0, 0, 1))
    assert not cloth.inputs.collider_paths


@pytest.mark.parametrize('way', ['moves', 'falls', 'grows'])
def test_contact_is_announced_before_it_is_possible(way):
    """Contact kernels may be compiled while `contact_possible` is False."""
    height = 1.0 if way == 'grows' else 0.3
    cloth = sphere_cloth(
        pins=[''], gravity=(0, 0, -9.81 * (way == 'falls')), sphere__position=(0.0, 0.0, height)
    )
    for n in range(60):
        if way == 'moves':
            cloth.move_sphere((0.0, 0.0, height + (n + 1) / 60))
        possible = cloth.contact_possible(1 / 60)
        cloth.advance(1 / 60)
        if penetration(cloth) > -1e-3:
            assert possible
            return
        assert n > 2 or not possible
    raise AssertionError('no contact')
