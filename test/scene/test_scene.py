"""Scenes: defaults, refused values, and the ways to give parameters."""

import array
import math
from fractions import Fraction

import numpy as np
import pytest
from builders import examples, scene_of, seeds
from hypothesis import given

from cloth_ros import Scene, Springs
from cloth_ros.scene.parameter import PARAMETERS

# The contract with users: names and defaults.
DEFAULTS = [
    ('', {'frame_id': 'world', 'rate': 60.0, 'drag': 0.5, 'gravity': (0.0, 0.0, -9.81)}),
    ('', {'pins': ('0,0', '0,-1')}),
    ('sheet.', {'rows': 32, 'columns': 32, 'size': (1.0, 1.0), 'mass': 0.2}),
    ('sheet.', {'position': (0.0, 0.0, 1.0), 'orientation': (0.0, 0.0, 0.0, 1.0)}),
    ('springs.', {'structural': 500.0, 'shear': 250.0, 'bending': 50.0, 'damping': 0.0}),
    ('wind.', {'velocity': (0.0, 0.0, 0.0), 'air_density': 1.2, 'drag_coefficient': 1.0}),
    ('wind.gust.', {'period': 0.0, 'duration': 1.0, 'direction': (0.0, 1.0, 0.0), 'seed': 0}),
    ('wind.gust.', {'speed': (0.0, 5.0)}),
    ('sphere.', {'radius': 0.0, 'position': (0.0, 0.0, 0.0), 'friction': 0.3}),
    ('collider.', {'names': ()}),
    ('gripper.', {'names': ()}),
    ('self_contact.', {'thickness': 0.0, 'friction': 0.3}),
    ('solver.', {'method': 'auto', 'substeps': 0, 'tolerance': 0.001, 'precision': 'single'}),
    ('solver.', {'threads': 1, 'max_tick': 0.1, 'overload': 'slow_motion'}),
    ('particles.', {'rate': 0.0, 'velocities': True}),
    ('markers.', {'rate': 30.0, 'springs': False, 'meshes': 'triangles'}),
    ('clock.', {'publish': False, 'rate': 0.0}),
    ('snapshot.', {'file': ''}),
]


def test_names_and_defaults():
    expected = {prefix + name: group[name] for prefix, group in DEFAULTS for name in group}
    assert Scene().flat() == expected
    assert set(PARAMETERS) == set(expected)


@pytest.mark.parametrize(
    ('name', 'value', 'parts'),
    [
        ('rate', 0.0, ['rate', '0.0', '1 to 1000 Hz']),
        ('rate', math.nan, ['rate', 'nan', 'finite']),
        ('rate', 'fast', ['rate', "'fast'", 'number']),
        ('rate', array.array('d', [1, 2]), ['rate is [1.0, 2.0]', 'number']),
        ('sheet', 4, ['sheet is 4', 'a group of parameters']),
        ('sheet.rows', 0, ['sheet.rows', '0', '1 to 1024']),
        ('sheet.rows', 2.5, ['sheet.rows', '2.5', 'whole']),
        ('sheet.rows', True, ['sheet.rows', 'True', 'number']),
        ('sheet.rows', Fraction(10**20 - 1, 10**20), ['sheet.rows', 'Fraction', '1 to 1024']),
        ('sheet.size', [1.0], ['sheet.size', '[1.0]', '2 numbers']),
        ('sheet.size', 3.0, ['sheet.size', '3.0', 'list']),
        ('sheet.size', [1.0, -1.0], ['sheet.size[1]', '-1.0', 'm']),
        ('sheet.orientation', [0, 0, 0, 0], ['sheet.orientation', 'other than zero']),
        ('springs.shear', 1e9, ['springs.shear', '1e+08 N/m', 'nearest']),
        ('spring.shear', 1.0, ["'spring.shear'", "did you mean 'springs.shear'"]),
        ('wind.gust.speed', [5, 1], ['wind.gust.speed', 'write [1.0, 5.0]']),
        ('wind.gust.period', 0.5, ['wind.gust.duration', '0.5 s']),
        ('sphere.radius', 1e-5, ['sphere.radius', '0.0001']),
        ('solver.method', np.zeros(3), ['solver.method', '0.', 'position_verlet']),
        ('solver.method', 'magic', ['solver.method', "'magic'", 'position_verlet']),
        ('markers.springs', 1, ['markers.springs', 'true or false']),
        ('pins', '0,0', ['pins', 'list']),
        ('pins', ['0'], ['pins', '"row,column"']),
        ('pins', ['32,0'], ['pins', "'32,0'", '-32 to 31']),
        ('pins', ['5:5,0'], ['pins', 'at least one particle']),
        ('pins', ['::00,0'], ['pins', "'::00,0'", 'write "0,0"']),
        ('pins', ['0,::٠'], ['pins', 'write "0,0"']),
    ],
)
def test_an_error_names_the_value_the_range_and_the_remedy_in_one_line(name, value, parts):
    with pytest.raises(ValueError, match=' is ') as refusal:
        Scene().with_parameters({name: value})
    message = str(refusal.value)
    assert all(part in message for part in parts), message
    assert '\n' not in message


def test_groups_are_mappings_objects_or_dotted_names():
    expected = Scene(springs=Springs(shear=7.0), wind={'gust': {'seed': 3}})
    assert Scene.from_parameters({'springs.shear': 7, 'wind': {'gust.seed': 3}}) == expected
    scene = scene_of(sheet__rows=7, sheet__columns=8, wind__gust__period=5.0)
    # An object replaces the group, a mapping updates it.
    for group, columns in ((Scene(sheet={'rows': 9}).sheet, 32), ({'rows': 9}, 8)):
        sheet = scene.with_parameters({'sheet': group}).sheet
        assert (sheet.rows, sheet.columns) == (9, columns)
    assert scene.with_parameters({'wind.gust': Scene().wind.gust}).wind == Scene().wind
    with pytest.raises(AttributeError):
        scene.rate = -1.0


@pytest.mark.parametrize('order', [1, -1])
def test_values_given_in_two_places_are_merged(order):
    two = [('wind', {'gust': {'speed': [1.0, 2.0]}}), ('wind.gust', {'period': 5.0})]
    gust = Scene.from_parameters(dict(two[::order])).wind.gust
    assert (gust.speed, gust.period) == ((1.0, 2.0), 5.0)
    two = [('sheet', Scene(sheet={'columns': 4}).sheet), ('sheet.rows', 8)]
    sheet = Scene.from_parameters(dict(two[::order])).sheet
    assert (sheet.rows, sheet.columns) == (8, 4)


@examples(0.5)
@given(seeds)
def test_normalised_vectors_are_the_same_bits_when_checked_again(seed):
    """Each change checks the whole scene again, and fixed parameters must not differ then."""
    four, three = np.split(np.random.default_rng(seed).normal(size=7), [4])
    scene = scene_of(sheet__orientation=four, wind__gust__direction=three)
    assert scene.with_parameters({}) == scene
