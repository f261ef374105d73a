"""Public interface of the model: state, commands, configuration."""

import gc
import math
import weakref

import numpy as np
import pytest
from builders import cloth_of, scene_of, small_cloth

from cloth_ros import Cloth, Inputs, Scene
from cloth_ros.model import check_scene

SMALL = scene_of(sheet__rows=6, sheet__columns=7)


def test_the_sheet_starts_flat_at_its_position_and_orientation():
    quarter_turn = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # columns then run along +y
    sheet = {'rows': 3, 'columns': 5, 'size': (2.0, 1.0), 'position': (1, 2, 3)}
    p = Cloth(Scene(sheet=sheet)).positions
    assert p.shape == (3, 5, 3)
    np.testing.assert_allclose(p[0, 0], (0, 1.5, 3), atol=1e-6)
    np.testing.assert_allclose(p[0, -1], (2, 1.5, 3), atol=1e-6)
    np.testing.assert_allclose(p[-1, 0], (0, 2.5, 3), atol=1e-6)
    q = Cloth(Scene(sheet={**sheet, 'orientation': quarter_turn})).positions
    np.testing.assert_allclose(q[0, -1] - q[0, 0], (0, 2, 0), atol=1e-6)
    np.testing.assert_allclose(q[-1, 0] - q[0, 0], (-1, 0, 0), atol=1e-6)


@pytest.mark.parametrize(('rows', 'columns'), [(1, 1), (1, 5), (5, 1), (2, 2), (3, 1), (200, 3)])
def test_sheets_of_every_shape_can_be_advanced(rows, columns):
    cloth = cloth_of(sheet__rows=rows, sheet__columns=columns, pins=['0,0'])
    cloth.wind = (3, 0, 1)
    cloth.advance(0.2)
    assert np.isfinite(cloth.positions).all()
    assert cloth.largest_strain() < 1.0


# Single precision far from the origin of the world


def test_the_motion_is_the_same_far_from_the_origin():
    near, far = Cloth(SMALL), Cloth(SMALL.with_parameters({'sheet.position': [1e5, -1e5, 1e5]}))
    for cloth in (near, far):
        cloth.advance(0.5)
    shift = np.array((1e5, -1e5, 1e5 - 1))
    np.testing.assert_allclose(far.positions - shift, near.positions, atol=1e-9)


def test_a_sheet_that_flies_far_keeps_its_shape():
    cloth = small_cloth(pins=[''], gravity=[0, 0, 0], wind__air_density=0.0, drag=0.0)
    cloth.velocities = np.broadcast_to((300.0, 0, -500.0), (6, 7, 3))
    cloth.advance(20.0)
    np.testing.assert_allclose(cloth.positions.mean((0, 1)), (6000, 0, -9999), atol=0.1)
    assert cloth.largest_strain() < 5e-3


def test_a_sheet_that_is_placed_far_away_keeps_its_shape():
    """Single precision resolves 6 cm at a distance of 1000 km."""
    cloth = Cloth(SMALL)
    moved = cloth.positions + np.array([1e6, -1e6, 1e3])
    cloth.positions = moved
    assert np.abs(cloth.positions - moved).max() < 1e-6
    cloth.advance(0.1)
    assert cloth.largest_strain() < 0.1


# State and commands


def test_fields_are_read_only_copies_and_can_be_assigned():
    cloth = Cloth(SMALL)
    for name in ('positions', 'velocities'):
        with pytest.raises(ValueError, match='read-only'):
            getattr(cloth, name)[0, 0] = 0
        moved = getattr(cloth, name) + 0.5 * ~cloth.scene.pinned()[..., None]
        setattr(cloth, name, moved)
        np.testing.assert_allclose(getattr(cloth, name), moved, atol=1e-6)
        for wrong in (np.zeros((7, 6, 3)), np.full((6, 7, 3), np.nan), [[1.0], [1.0, 2.0]]):
            with pytest.raises(ValueError, match=f'{name} is .*, but must be .*; correct it'):
                setattr(cloth, name, wrong)


def test_fields_are_written_to_arrays_of_the_caller():
    cloth = Cloth(SMALL)
    cloth.advance(0.1)
    particles, positions = np.empty((6, 7, 6), np.float32), np.empty((6, 7, 3))
    cloth.write_particles(particles)
    cloth.write_positions(positions)
    assert np.array_equal(positions, cloth.positions)
    assert np.array_equal(particles[..., :3], cloth.positions.astype(np.float32))
    assert np.array_equal(particles[..., 3:], cloth.velocities)


def test_time_is_the_sum_of_the_advances():
    cloth = Cloth(SMALL)
    for seconds in (1 / 60, 0.0, 1e-6, 0.37, 2.0):
        before = cloth.time
        cloth.advance(seconds)
        assert cloth.time == before + seconds


@pytest.mark.parametrize('seconds', [-1.0, math.nan, math.inf, 1e300])
def test_an_invalid_duration_is_refused(seconds):
    with pytest.raises(ValueError, match=r'seconds is .*0 to 1e'):
        Cloth(SMALL).advance(seconds)


@pytest.mark.parametrize('wind', [(1, 2), (1, 2, math.nan), (0, 0, 1e5), 'north', None])
def test_an_invalid_wind_is_refused_and_the_former_one_holds(wind):
    cloth = Cloth(SMALL)
    cloth.wind = (1, 2, 3)
    with pytest.raises(ValueError, match=r'wind is .*-10000 to 10000 m/s'):
        cloth.wind = wind
    assert cloth.wind == (1, 2, 3)
    with pytest.raises(ValueError, match=r'wind is .*-10000 to 10000 m/s'):
        Inputs(wind=wind)


def test_inputs_of_an_advance_take_the_place_of_commands():
    cloth, other = (small_cloth(sphere__radius=0.1, sphere__position=(0, 0, 3)) for _ in '12')
    cloth.wind = (0.0, 5.0, 0.0)
    for position in ((0.0, 0.0, 2.0), (0.0, 0.1, 2.0)):
        cloth.move_sphere(position)
    path = ((0.0, 0.0, 2.0), (0.0, 0.1, 2.0))
    assert cloth.inputs == Inputs((0.0, 5.0, 0.0), {'sphere': path})
    other.advance(0.1, cloth.inputs)
    cloth.advance(0.1)
    for each in (cloth, other):
        assert each.inputs == Inputs((0.0, 5.0, 0.0))  # the wind holds, the way is done
        assert each.sphere_position == (0.0, 0.1, 2.0)
    assert np.array_equal(cloth.positions, other.positions)


@pytest.mark.parametrize(
    'point', [(0.0, 0.0, math.nan), (0.0, 0.0, 1e30), (1.0, 2.0), 'up', None, 1.0]
)
def test_an_invalid_waypoint_of_an_input_is_refused(point):
    with pytest.raises(ValueError, match=r'waypoint of sphere is .*-1e\+06 to 1e\+06 m'):
        Inputs(collider_paths={'sphere': [point]})


# Configuration


def test_a_new_scene_continues_from_the_present_state():
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    p, v = cloth.positions, cloth.velocities
    cloth.configure(SMALL.with_parameters({'springs.shear': 0.0, 'solver.precision': 'double'}))
    assert np.array_equal(cloth.positions, p)
    assert np.array_equal(cloth.velocities, v)
    cloth.advance(0.1)
    assert not np.array_equal(cloth.positions, p)


def test_the_wind_of_a_scene_takes_effect_when_it_changes_only():
    cloth = Cloth(SMALL)
    cloth.wind = (1.0, 2.0, 3.0)
    cloth.configure(SMALL.with_parameters({'drag': 1.0}))
    assert cloth.wind == (1.0, 2.0, 3.0)
    cloth.configure(SMALL.with_parameters({'wind.velocity': [4.0, 0.0, 0.0]}))
    assert cloth.wind == (4.0, 0.0, 0.0)


def test_particles_pinned_while_a_cloth_runs_stay_where_they_are():
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    before = cloth.positions
    cloth.configure(SMALL.with_parameters({'pins': ['-1,:']}))
    cloth.advance(0.1)
    assert np.array_equal(cloth.positions[-1], before[-1])
    assert not np.array_equal(cloth.positions[0, 0], before[0, 0])


def test_fixed_parameters_and_other_objects_are_refused():
    cloth = Cloth(SMALL)
    with pytest.raises(ValueError, match=r'sheet\.rows is 5, .* 6 as before; make a new Cloth'):
        cloth.configure(SMALL.with_parameters({'sheet.rows': 5}))
    for refuse in (cloth.configure, Cloth, check_scene):
        with pytest.raises(ValueError, match=r'scene is None, but must be a cloth_ros\.Scene'):
            refuse(None)
    assert cloth.scene == SMALL


def test_arrays_of_a_former_scene_are_freed_at_once():
    """Arrays of NumPy do not make the garbage collector run."""
    cloth = Cloth(SMALL)
    cloth.advance(0.1)
    gc.disable()
    try:
        before = weakref.ref(cloth._simulation._kick_drift)
        cloth.configure(SMALL.with_parameters({'springs.bending': 5.0}))
        assert before() is None
    finally:
        gc.enable()
