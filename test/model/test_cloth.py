"""Public interface of the model: state, commands, configuration."""

import gc
import math
import weakref

import numpy as np
import pytest
from builders import scene_of, small_cloth

from cloth_ros import Cloth, Inputs, Scene
from cloth_ros.model import check_scene

SMALL = scene_of(sheet__rows=6, sheet__columns=7)


def test_the_sheet_starts_flat_at_its_position_and_orientation():
    quarter_turn = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # columns then run along +y
    sheet = {'rows': 3, 'columns': 5, 'size': (2.0, 1.0), 'position': (1, 2, 3)}
    p = Cloth(Scene(sheet=sheet)).positions
    corners = [(0, 1.5, 3), (2, 1.5, 3), (0, 2.5, 3)]
    np.testing.assert_allclose([p[0, 0], p[0, -1], p[-1, 0]], corners, atol=1e-6)
    q = Cloth(Scene(sheet={**sheet, 'orientation': quarter_turn})).positions
    edges = [q[0, -1] - q[0, 0], q[-1, 0] - q[0, 0]]
    np.testing.assert_allclose(edges, [(0, 2, 0), (-1, 0, 0)], atol=1e-6)


def test_single_precision_is_as_exact_far_from_the_origin():
    """Positions in single precision have steps of 6 cm at a distance of 1000 km."""
    near, far = Cloth(SMALL), Cloth(SMALL.with_parameters({'sheet.position': [1e5, -1e5, 1e5]}))
    for cloth in (near, far):
        cloth.advance(0.5)
    np.testing.assert_allclose(far.positions - near.positions, [[(1e5, -1e5, 1e5 - 1)] * 7] * 6)
    moved = near.positions + np.array([1e6, -1e6, 1e3])
    near.positions = moved
    assert np.abs(near.positions - moved).max() < 1e-6
    near.advance(0.1)
    assert near.strain().stretch < 0.1
    flying = small_cloth(pins=[''], gravity=[0, 0, 0], wind__air_density=0.0, drag=0.0)
    flying.velocities = np.broadcast_to((300.0, 0, -500.0), (6, 7, 3))
    flying.advance(20.0)
    np.testing.assert_allclose(flying.positions.mean((0, 1)), (6000, 0, -9999), atol=0.1)
    assert flying.strain().stretch < 5e-3


# State and commands


@pytest.mark.parametrize('name', ['positions', 'velocities'])
def test_fields_are_read_only_copies_and_can_be_assigned(name):
    cloth = Cloth(SMALL)
    with pytest.raises(ValueError, match='read-only'):
        getattr(cloth, name)[0, 0] = 0
    moved = getattr(cloth, name) + 0.5 * ~cloth.scene.pinned()[..., None]
    setattr(cloth, name, moved)
    np.testing.assert_allclose(getattr(cloth, name), moved, atol=1e-6)
    for wrong in (np.zeros((7, 6, 3)), np.full((6, 7, 3), np.nan), [[1.0], [1.0, 2.0]]):
        remedy = f'change a copy: cloth.{name}.copy'
        with pytest.raises(ValueError, match=f'{name} is .*, but must be .*; {remedy}'):
            setattr(cloth, name, wrong)
    setattr(cloth, name, getattr(cloth, name).copy())
    particles, positions = np.empty((6, 7, 6), np.float32), np.empty((6, 7, 3))
    cloth.write_particles(particles)
    cloth.write_positions(positions)
    assert np.array_equal(positions, cloth.positions)
    assert np.array_equal(particles[..., :3], cloth.positions.astype(np.float32))
    assert np.array_equal(particles[..., 3:], cloth.velocities)


def test_time_is_the_sum_of_the_advances_and_invalid_ones_are_refused():
    cloth = Cloth(SMALL)
    for seconds in (1 / 60, 0.0, 1e-6, 0.37, 2.0):
        before = cloth.time
        cloth.advance(seconds)
        assert cloth.time == before + seconds
    for seconds in (-1.0, math.nan, math.inf, 1e300):
        with pytest.raises(ValueError, match=r'seconds is .*0 to 1e'):
            cloth.advance(seconds)


@pytest.mark.parametrize('vector', [(1, 2), (1, 2, math.nan), (0, 0, 1e7), 'north', None, 1.0])
def test_invalid_commands_and_inputs_are_refused_and_the_former_ones_hold(vector):
    cloth = small_cloth(sphere__radius=0.1, wind__velocity=(1, 2, 3))
    cloth.move_sphere((0, 0, 0.5))
    before = cloth.inputs
    with pytest.raises(ValueError, match=r'wind is .*-10000 to 10000 m/s'):
        cloth.wind = vector
    with pytest.raises(ValueError, match=r'sphere position is .*-1e\+06 to 1e\+06 m'):
        cloth.move_sphere(vector)
    assert cloth.inputs == before == Inputs((1, 2, 3), {'sphere': [(0, 0, 0.5)]})
    with pytest.raises(ValueError, match=r'wind is .*-10000 to 10000 m/s'):
        Inputs(wind=vector)
    with pytest.raises(ValueError, match=r'waypoint of sphere is .*-1e\+06 to 1e\+06 m'):
        Inputs(collider_paths={'sphere': [vector]})
    for paths in (None, {'sphere': 1.0}):
        with pytest.raises(ValueError, match='but must be a'):
            Inputs(collider_paths=paths)


def test_inputs_of_an_advance_take_the_place_of_commands():
    cloth, other = (small_cloth(sphere__radius=0.1, sphere__position=(0, 0, 3)) for _ in '12')
    cloth.wind, path = (0.0, 5.0, 0.0), ((0.0, 0.0, 2.0), (0.0, 0.1, 2.0))
    for position in path:
        cloth.move_sphere(position)
    assert cloth.inputs == Inputs((0.0, 5.0, 0.0), {'sphere': path})
    other.advance(0.1, cloth.inputs)
    cloth.advance(0.1)
    for each in (cloth, other):
        assert each.inputs == Inputs((0.0, 5.0, 0.0))  # the wind holds, the way is done
        assert each.sphere_position == (0.0, 0.1, 2.0)
    assert np.array_equal(cloth.positions, other.positions)
    with pytest.raises(ValueError, match="collider is 'spere', but must be one of: sphere"):
        cloth.advance(0.1, Inputs(collider_paths={'spere': path}))
    assert cloth.time == 0.1


# Configuration


def test_a_new_scene_continues_from_the_present_state():
    cloth = Cloth(SMALL)
    cloth.wind = (1.0, 2.0, 3.0)
    cloth.advance(0.3)
    p, v = cloth.positions, cloth.velocities
    changes = {'springs.shear': 20.0, 'solver.precision': 'double', 'pins': ['-1,:']}
    cloth.configure(SMALL.with_parameters(changes))
    assert np.array_equal(cloth.positions, p)
    assert np.array_equal(cloth.velocities, v * ~cloth.scene.pinned()[..., None])
    assert cloth.wind == (1.0, 2.0, 3.0)
    cloth.advance(0.1)
    assert np.array_equal(cloth.positions[-1], p[-1])  # pinned where they were
    assert not np.array_equal(cloth.positions[0, 0], p[0, 0])
    cloth.configure(cloth.scene.with_parameters({'wind.velocity': [4.0, 0.0, 0.0]}))
    assert cloth.wind == (4.0, 0.0, 0.0)


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
    before = weakref.ref(cloth._simulation._kick_drift)
    gc.disable()
    cloth.configure(SMALL.with_parameters({'springs.bending': 5.0}))
    freed = before() is None
    gc.enable()
    assert freed
