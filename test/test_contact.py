import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from reference import crossings, distances, triangles

from cloth_ros import Cloth, Scene
from cloth_ros.model.contact.closest_point import closest_point

CONFIG = Path(__file__).parent.parent / 'config'
TOLERANCE = 1e-4  # m, what contact leaves uncorrected, and a little for single precision
ROUNDING = 2e-6


def depth(cloth: Cloth) -> float:
    """Greatest depth of a triangle in the sphere, whichever diagonal it is cut along, m."""
    corners = triangles(cloth.positions, both_diagonals=True)
    return cloth.sphere_radius - distances(corners, cloth.sphere_position).min()


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.01, 100), st.floats(1e-6, 1))
@example(0, 1.0, 1e-9)
def test_the_closest_point_is_the_closest(seed, offset, flatness):
    generator = np.random.default_rng(seed)
    corners = generator.normal(size=(3, 3)) * (1, 1, flatness) + generator.normal(size=3) * offset
    squared, a, b, c = closest_point(corners, 0, 1, 2)
    weights = np.array([a, b, c])
    assert weights.min() >= 0
    assert weights.sum() == pytest.approx(1)
    scale = np.abs(corners).max()
    point = weights @ corners
    assert math.sqrt(squared) == pytest.approx(np.linalg.norm(point), abs=1e-9 * scale)
    # Convexity: no corner lies nearer in the direction of the closest point.
    assert (corners @ point).min() >= squared - 1e-7 * scale * scale


def test_the_closest_point_of_degenerate_triangles():
    points = np.array([[1.0, 1, 0], [1, -1, 0], [3, 0, 0]])
    assert closest_point(points, 0, 1, 1) == (1.0, 0.5, 0.5, 0.0)
    assert closest_point(points, 2, 2, 2) == (9.0, 1.0, 0.0, 0.0)
    line = np.array([[1.0, 1, 0], [1, -1, 0], [1, 0.5, 0]])
    assert closest_point(line, 0, 1, 2)[0] == 1.0


@pytest.mark.parametrize('speed', [1.0, 5.0, 20.0, 100.0])
@pytest.mark.parametrize('offset', [(0.0, 0.0), (0.003, 0.005), (1 / 62, 1 / 62)])
def test_a_sphere_smaller_than_the_spacing_does_not_pass(speed, offset):
    cloth = Cloth(Scene.from_yaml(CONFIG / 'small_fast_sphere.yaml'))
    cloth.move_sphere((*offset, 1.5))
    cloth.advance(1e-3)
    z, steps = 1.5, 0
    while z > 0.5 or steps < 60:
        z = max(z - speed / 60, 0.5)
        steps += 1
        cloth.move_sphere((*offset, z))
        cloth.advance(1 / 60)
        assert depth(cloth) < TOLERANCE + ROUNDING
    # The sheet hangs below the sphere: a ray down meets it, a ray up does not.
    corners = triangles(cloth.positions)
    assert crossings(corners, cloth.sphere_position, (1e-5, 2e-5, -1)) % 2 == 1
    assert crossings(corners, cloth.sphere_position, (1e-5, 2e-5, 1)) % 2 == 0


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    rows=st.integers(2, 12),
    columns=st.integers(2, 12),
    radius=st.floats(0.002, 0.5),
    speed=st.floats(0.0, 200.0),
    pinned=st.booleans(),
    precision=st.sampled_from(['single', 'double']),
)
def test_no_sphere_ends_in_a_triangle(seed, rows, columns, radius, speed, pinned, precision):
    generator = np.random.default_rng(seed)
    start = generator.normal(size=3)
    start *= (0.75 + radius) / np.linalg.norm(start)
    cloth = Cloth(
        Scene(
            sheet={'rows': rows, 'columns': columns, 'position': (0, 0, 0)},
            pins=['0,0'] if pinned else [''],
            sphere={'radius': radius, 'position': start},
            solver={'precision': precision},
        )
    )
    direction = generator.normal(0, 0.2, 3) - start
    direction /= np.linalg.norm(direction)
    for n in range(1, 25):
        target = start + direction * min(speed * n / 60, 2.0)
        # A pinned particle in the way cannot give way: keep clear of it.
        if pinned and np.linalg.norm(target - cloth.positions[0, 0]) < 1.5 * radius + 0.05:
            break
        cloth.move_sphere(target)
        cloth.advance(1 / 60)
        assert np.isfinite(cloth.positions).all()
        assert depth(cloth) < TOLERANCE + ROUNDING


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_sheet_that_starts_in_the_sphere_is_pushed_out(precision):
    cloth = Cloth(
        Scene(
            pins=[''],
            sphere={'radius': 0.2, 'position': (0.01, 0.02, 1.03)},
            gravity=(0, 0, 0),
            solver={'precision': precision},
        )
    )
    for _ in range(30):
        cloth.advance(1 / 60)
    assert depth(cloth) < TOLERANCE + ROUNDING


def resting(friction: float, tilt: float) -> Cloth:
    """A small sheet on a sphere so large that it is a plane, under tilted gravity."""
    gravity = (9.81 * math.sin(tilt), 0, -9.81 * math.cos(tilt))
    return Cloth(
        Scene(
            sheet={'rows': 5, 'columns': 5, 'size': (0.1, 0.1), 'position': (0, 0, 1e-5)},
            pins=[''],
            sphere={'radius': 500.0, 'position': (0, 0, -500), 'friction': friction},
            drag=0.0,
            wind={'air_density': 0.0},
            gravity=gravity,
            solver={'precision': 'double'},
        )
    )


@pytest.mark.parametrize('tilt', [0.2, 0.5])
def test_friction_is_coulombs(tilt):
    """A block on an incline: it sticks for μ > tan(tilt), else slides at g (sin − μ cos)."""
    stuck = resting(1.2 * math.tan(tilt), tilt)
    stuck.advance(0.5)
    assert np.abs(stuck.positions - resting(0, tilt).positions).max() < 2e-3
    friction = 0.5 * math.tan(tilt)
    sliding = resting(friction, tilt)
    sliding.advance(0.1)
    before = sliding.velocities[..., 0].mean()
    sliding.advance(0.2)
    found = (sliding.velocities[..., 0].mean() - before) / 0.2
    assert found == pytest.approx(9.81 * (math.sin(tilt) - friction * math.cos(tilt)), rel=0.01)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), friction=st.floats(0, 2))
def test_a_sphere_at_rest_adds_no_energy(seed, friction):
    generator = np.random.default_rng(seed)
    cloth = Cloth(
        Scene(
            sheet={'rows': 8, 'columns': 8, 'position': (0, 0, 0)},
            pins=[''],
            drag=0.0,
            sphere={'radius': 0.25, 'position': (0.1, 0, -0.5), 'friction': friction},
            wind={'air_density': 0.0},
            gravity=(0, 0, 0),
            solver={'precision': 'double'},
        )
    )
    cloth.velocities = np.broadcast_to((*generator.normal(0, 0.5, 2), -4.0), (8, 8, 3))
    energies = [cloth.energy()]
    for _ in range(40):
        cloth.advance(1 / 60)
        energies.append(cloth.energy())
    assert max(energies) < 1.02 * energies[0]
    assert energies[-1] < energies[0]  # the impact is inelastic


@pytest.mark.parametrize(('rows', 'columns'), [(1, 12), (12, 1)])
def test_a_chain_is_caught_between_its_particles(rows, columns):
    cloth = Cloth(
        Scene(
            sheet={'rows': rows, 'columns': columns},
            pins=['0,0', '-1,-1'],
            sphere={'radius': 0.02, 'position': (0, 0, 1.5)},
        )
    )
    along = cloth.positions.reshape(-1, 3)
    middle = along[5:7].mean(0)
    for z in np.linspace(1.5, 0.7, 30):
        cloth.move_sphere((middle[0], middle[1], z))
        cloth.advance(1 / 60)
        p = cloth.positions.reshape(-1, 3)
        segments = np.stack([p[:-1], p[1:], p[1:]], axis=1)
        assert distances(segments, cloth.sphere_position).min() > 0.02 - TOLERANCE - ROUNDING
    assert cloth.positions[..., 2].min() < 0.75


def test_a_single_particle_is_caught():
    cloth = Cloth(
        Scene(
            sheet={'rows': 1, 'columns': 1},
            pins=[''],
            sphere={'radius': 0.1, 'position': (0, 0, 2)},
            gravity=(0, 0, 0),
            wind={'air_density': 0.0},
        )
    )
    cloth.move_sphere((0, 0, 0.5))
    cloth.advance(0.01)
    np.testing.assert_allclose(cloth.positions[0, 0], (0, 0, 0.4), atol=TOLERANCE)


def test_positions_between_two_advances_are_passed_in_their_order():
    """Around the edge of a sheet in three legs, where the straight way leads through it."""
    cloth = Cloth(
        Scene(
            sheet={'rows': 9, 'columns': 9},
            pins=[':,0', ':,-1', '0,:', '-1,:'],
            gravity=(0, 0, 0),
            wind={'air_density': 0.0},
            sphere={'radius': 0.05, 'position': (0, 0, 1.3)},
        )
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


@pytest.mark.parametrize('distance', [10.0, 900.0])
def test_a_sphere_that_jumps_takes_the_sheet_along_in_bounded_time(distance):
    cloth = Cloth(Scene.from_yaml(CONFIG / 'small_fast_sphere.yaml'))
    cloth.move_sphere((0, 0, 1.5 - distance))
    cloth.advance(1 / 60)
    for _ in range(5):
        cloth.advance(1 / 60)
        assert np.isfinite(cloth.positions).all()
    with pytest.raises(ValueError, match='within 1000 m of the sheet'):
        cloth.move_sphere((0, 0, -1e5))


def test_without_a_sphere_there_is_nothing_to_move():
    with pytest.raises(ValueError, match=r'sphere\.radius'):
        Cloth(Scene()).move_sphere((0, 0, 1))
    with pytest.raises(ValueError, match=r'sphere position is .*nan'):
        Cloth(Scene(sphere={'radius': 1.0})).move_sphere((0, math.nan, 1))


def pressed(**changes: object) -> Cloth:
    """A sphere that is pressed on a pinned edge."""
    base = {'pins': ['0,:'], 'sphere.radius': 0.1, 'sphere.position': [0.0, -0.5, 1.5]}
    cloth = Cloth(
        Scene().with_parameters({'sheet.rows': 12, 'sheet.columns': 12, **base, **changes})
    )
    for position in ((0.0, -0.5, 1.02), (0.0, -0.45, 0.98)):
        cloth.move_sphere(position)
        cloth.advance(0.1)
    return cloth


def test_a_sphere_on_a_pinned_edge_does_not_shake_the_sheet():
    cloth = pressed(drag=2.0)
    for _ in range(40):
        cloth.advance(0.5)
    assert 0.01 < cloth.sphere_depth <= 0.1
    assert np.sqrt(np.mean(cloth.velocities**2)) < 0.2  # m/s; once the fastest had 75
    assert cloth.rollbacks.held == 0


def test_a_change_of_a_parameter_leaves_a_sphere_as_large_as_it_is():
    cloth = pressed()
    cloth.configure(cloth.scene.with_parameters({'springs.bending': 51.0}))
    cloth.advance(1e-3)
    assert cloth.sphere_radius == 0.1
    twin = Cloth(cloth.scene)
    twin.adopt(cloth)
    twin.advance(1e-3)
    assert twin.sphere_radius == 0.1


def test_a_sphere_that_appears_in_the_sheet_grows_and_throws_nothing():
    scene = {'sphere.radius': 0.3, 'sphere.position': [0.0, 0.0, 1.0]}
    cloth = Cloth(Scene().with_parameters(scene))
    cloth.advance(0.01)
    assert cloth.sphere_radius == pytest.approx(0.01, abs=2e-4)
    cloth.configure(cloth.scene.with_parameters({'springs.bending': 51.0}))
    assert cloth.sphere_radius == pytest.approx(0.01, abs=2e-4)
    fastest = 0.0
    for _ in range(40):
        cloth.advance(0.01)
        fastest = max(fastest, float(np.linalg.norm(cloth.velocities, axis=-1).max()))
        assert depth(cloth) < TOLERANCE + ROUNDING
    assert cloth.sphere_radius == 0.3
    assert fastest < 10  # m/s
    assert cloth.rollbacks.text == ''


def test_a_sphere_that_appears_grows_as_well_when_a_stretch_is_repeated():
    cloth = Cloth(Scene().with_parameters({'sphere.radius': 0.3, 'sphere.position': [0, 0, 1.0]}))
    cloth.advance(0.01)
    cloth.positions = cloth.positions
    cloth._state.velocity[2, cloth._grid_layout.begin + 40] = 1e6
    cloth.advance(0.01)
    assert cloth.sphere_radius < 0.05


def test_a_sheet_at_rest_on_a_sphere_has_no_work_done_on_it():
    scene = {
        'sheet.rows': 9,
        'sheet.columns': 9,
        'pins': [''],
        'sphere.radius': 0.5,
        'sphere.position': [0.0, 0.0, 0.49],
        'sphere.friction': 1.0,
        'drag': 20.0,
    }
    cloth = Cloth(Scene().with_parameters(scene))
    for _ in range(60):
        cloth.advance(1 / 60)
    before = cloth.work
    for _ in range(60):
        cloth.advance(1 / 60)
    assert cloth.work - before < 1e-4  # J in a second


@pytest.mark.parametrize(
    ('size', 'pins', 'radius', 'start', 'end', 'speed'),
    [
        (12, ['0,:', '-1,:'], 0.3, (0.0, 0.0, 0.3), (0.0, 0.0, 1.5), 1.0),
        (20, ['0,:'], 0.05, (0.0, -0.45, 0.6), (0.0, -0.45, 1.6), 1.0),
        (20, ['0,0', '0,-1'], 0.1, (-1.0, -0.5, 1.0), (0.2, -0.5, 1.0), 0.5),
    ],
)
def test_nothing_is_repeated_where_a_slow_sphere_pushes(size, pins, radius, start, end, speed):
    scene = {'sheet.rows': size, 'sheet.columns': size, 'pins': pins}
    sphere = {'sphere.radius': radius, 'sphere.position': start}
    cloth = Cloth(Scene().with_parameters({**scene, **sphere}))
    way = np.array(end) - start
    ticks = round(60 * np.linalg.norm(way) / speed)
    for n in range(ticks + 120):
        cloth.move_sphere((start + way * min((n + 1) / ticks, 1.0)).tolist())
        cloth.advance(1 / 60)
    assert cloth.rollbacks.text == ''
