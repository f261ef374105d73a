import array
import math
import os
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene, Springs
from cloth_ros.scene.parameter import PARAMETERS

CONFIG = Path(__file__).parent.parent / 'config'

# The contract with users: names and defaults.
DEFAULTS = {
    'frame_id': 'world',
    'rate': 60.0,
    'sheet.rows': 32,
    'sheet.columns': 32,
    'sheet.size': (1.0, 1.0),
    'sheet.mass': 0.2,
    'sheet.position': (0.0, 0.0, 1.0),
    'sheet.orientation': (0.0, 0.0, 0.0, 1.0),
    'pins': ('0,0', '0,-1'),
    'springs.structural': 500.0,
    'springs.shear': 250.0,
    'springs.bending': 50.0,
    'springs.damping': 0.0,
    'drag': 0.5,
    'gravity': (0.0, 0.0, -9.81),
    'wind.velocity': (0.0, 0.0, 0.0),
    'wind.air_density': 1.2,
    'wind.drag_coefficient': 1.0,
    'wind.gust.period': 0.0,
    'wind.gust.duration': 1.0,
    'wind.gust.direction': (0.0, 1.0, 0.0),
    'wind.gust.speed': (0.0, 5.0),
    'wind.gust.seed': 0,
    'sphere.radius': 0.0,
    'sphere.position': (0.0, 0.0, 0.0),
    'sphere.friction': 0.3,
    'solver.method': 'auto',
    'solver.substeps': 0,
    'solver.tolerance': 0.001,
    'solver.precision': 'single',
    'solver.threads': 1,
    'solver.max_tick': 0.1,
    'solver.overload': 'slow_motion',
    'markers.rate': 30.0,
    'markers.springs': False,
}


def test_the_defaults_are_the_contract():
    assert Scene().flat() == DEFAULTS
    assert set(PARAMETERS) == set(DEFAULTS)


@pytest.mark.parametrize(
    ('changes', 'parts'),
    [
        ({'rate': 0.0}, ['rate', '0.0', '1 to 1000 Hz']),
        ({'rate': math.nan}, ['rate', 'nan', 'finite']),
        ({'rate': 'fast'}, ['rate', "'fast'", 'number']),
        ({'sheet.rows': 0}, ['sheet.rows', '0', '1 to 1024']),
        ({'sheet.rows': 2.5}, ['sheet.rows', '2.5', 'whole']),
        ({'sheet.rows': True}, ['sheet.rows', 'True', 'number']),
        ({'sheet.size': [1.0]}, ['sheet.size', '[1.0]', '2 numbers']),
        ({'sheet.size': 3.0}, ['sheet.size', '3.0', 'list']),
        ({'sheet.size': [1.0, -1.0]}, ['sheet.size[1]', '-1.0', 'm']),
        ({'sheet.mass': -1}, ['sheet.mass', '-1', 'kg']),
        ({'sheet.orientation': [0, 0, 0, 0]}, ['sheet.orientation', 'other than zero']),
        ({'springs.shear': 1e9}, ['springs.shear', '1e+08 N/m', 'nearest']),
        ({'gravity': [0, 0, math.inf]}, ['gravity[2]', 'inf', 'finite']),
        ({'wind.gust.speed': [5, 1]}, ['wind.gust.speed', 'swap']),
        ({'wind.gust.period': 0.5}, ['wind.gust.duration', '0.5 s']),
        ({'wind.gust.direction': [0, 0, 0]}, ['wind.gust.direction', 'zero']),
        ({'sphere.radius': 1e-5}, ['sphere.radius', '0.0001']),
        ({'solver.method': np.zeros(3)}, ['solver.method', '0.', 'position_verlet']),
        ({'sheet.rows': Fraction(10**20 - 1, 10**20)}, ['sheet.rows', 'Fraction', '1 to 1024']),
        ({'rate': array.array('d', [1, 2])}, ['rate is [1.0, 2.0]', 'number']),
        ({'solver.method': 'magic'}, ['solver.method', "'magic'", 'position_verlet']),
        ({'solver.substeps': 3}, ['solver.substeps', '3', 'at least']),
        ({'solver.threads': 65}, ['solver.threads', '65', '1 to 64']),
        ({'markers.springs': 1}, ['markers.springs', 'true or false']),
        ({'pins': '0,0'}, ['pins', 'list']),
        ({'pins': ['0']}, ['pins', '"row,column"']),
        ({'pins': ['32,0']}, ['pins', "'32,0'", '-32 to 31']),
        ({'pins': ['0,a']}, ['pins', "'0,a'"]),
        ({'pins': ['5:5,0']}, ['pins', 'at least one particle']),
        ({'pins': ['::0,0']}, ['pins', "'::0,0'", 'correct the row']),
        ({'pins': ['::00,0']}, ['pins', "'::00,0'", 'correct the row']),
        ({'pins': ['0,::٠']}, ['pins', 'correct the column']),
        ({'spring.shear': 1.0}, ["'spring.shear'", "did you mean 'springs.shear'"]),
        ({'sheet': 4}, ['sheet is 4', 'a group of parameters']),
    ],
)
def test_refusals_name_the_value_the_range_and_the_remedy(changes, parts):
    with pytest.raises(ValueError, match=' is ') as refusal:
        Scene().with_parameters(changes)
    message = str(refusal.value)
    assert all(part in message for part in parts), message
    assert '\n' not in message


def test_groups_may_be_mappings_objects_or_dotted_names():
    expected = Scene(springs=Springs(shear=7.0), wind={'gust': {'seed': 3}})
    assert Scene.from_parameters({'springs.shear': 7, 'wind': {'gust.seed': 3}}) == expected
    assert Scene(springs={'shear': 7}).springs.shear == 7.0
    assert expected.with_parameters({'wind.gust.seed': 3}) == expected


def test_a_whole_group_replaces_what_a_scene_had():
    scene = Scene(sheet={'rows': 7, 'columns': 8}, wind={'gust': {'period': 5.0}})
    sheet = scene.with_parameters({'sheet': Scene(sheet={'rows': 9}).sheet}).sheet
    assert (sheet.rows, sheet.columns) == (9, Scene().sheet.columns)
    assert scene.with_parameters({'wind.gust': Scene().wind.gust}).wind == Scene().wind
    sheet = scene.with_parameters({'sheet': {'rows': 9}}).sheet
    assert (sheet.rows, sheet.columns) == (9, 8)


@pytest.mark.parametrize('turned', [False, True])
def test_what_is_given_in_two_places_is_all_heeded(turned):
    two = [('wind', {'gust': {'speed': [1.0, 2.0]}}), ('wind.gust', {'period': 5.0})]
    gust = Scene.from_parameters(dict(two[::-1] if turned else two)).wind.gust
    assert (gust.speed, gust.period) == ((1.0, 2.0), 5.0)
    two = [('sheet', Scene(sheet={'columns': 4}).sheet), ('sheet.rows', 8)]
    sheet = Scene.from_parameters(dict(two[::-1] if turned else two)).sheet
    assert (sheet.rows, sheet.columns) == (8, 4)


def test_what_was_normalised_stays_to_the_bit():
    """A scene is checked again with every change, and its fixed parameters must not differ."""
    generator = np.random.default_rng(0)
    for _ in range(200):
        scene = Scene(
            sheet={'orientation': generator.normal(size=4)},
            wind={'gust': {'direction': generator.normal(size=3)}},
        )
        assert scene.with_parameters({}) == scene


def test_a_scene_cannot_be_changed_into_an_invalid_one():
    with pytest.raises(AttributeError):
        Scene().rate = -1  # type: ignore[misc]


@pytest.mark.parametrize(
    ('pins', 'expected'),
    [
        (['0,0', '0,-1'], {(0, 0), (0, 4)}),
        (['0,:'], {(0, j) for j in range(5)}),
        (['-1 , 1:4:2'], {(3, 1), (3, 3)}),
        (['::-3,0'], {(3, 0), (0, 0)}),
        ([''], set()),
        ([], set()),
    ],
)
def test_pins_read_as_python_indices_and_slices(pins, expected):
    scene = Scene(sheet={'rows': 4, 'columns': 5}, pins=pins)
    assert set(zip(*np.nonzero(scene.pinned()), strict=True)) == expected


def test_stability_is_judged_with_the_whole_scene_in_view():
    scene = Scene(solver={'substeps': 60})
    with pytest.raises(ValueError, match=r'solver\.substeps is 60.*at least'):
        scene.with_parameters({'springs.structural': 50_000.0})


@given(st.sampled_from(sorted(DEFAULTS)), st.floats() | st.integers() | st.text() | st.none())
def test_no_value_gets_past_unchecked(name, value):
    """Whatever is given, the scene is valid or a ValueError of one line says why not."""
    try:
        scene = Scene().with_parameters({name: value})
    except ValueError as refusal:
        message = str(refusal)
        assert name in message
    else:
        assert type(scene.flat()[name]) is type(DEFAULTS[name])


@pytest.mark.parametrize('path', sorted(CONFIG.glob('*.yaml')), ids=lambda path: path.stem)
def test_the_ready_scenes_are_valid_and_move(path):
    cloth = Cloth(Scene.from_yaml(path))
    cloth.advance(0.1)
    assert np.isfinite(cloth.positions).all()


@pytest.mark.parametrize(
    'text',
    [
        '',
        '[',
        '42',
        'other: {ros__parameters: {rate: 5.0}}',
        'cloth: {ros__parameters: 3}',
        '"/**": {ros__parameters: {rate: !!python/object/apply:os.getcwd []}}',
        '"/**": {ros__parameters: {rat: 60.0}}',
    ],
)
def test_files_that_are_no_scene_are_refused_in_one_line(tmp_path, text):
    path = tmp_path / 'scene.yaml'
    path.write_text(text)
    with pytest.raises(ValueError, match=r'scene\.yaml') as refusal:
        Scene.from_yaml(path)
    assert '\n' not in str(refusal.value)


def test_parameter_files_may_name_the_node_and_set_what_nodes_have(tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text(
        '/**: {ros__parameters: {use_sim_time: true, rate: 30, sheet.rows: 4}}\n'
        '/lab/cloth: {ros__parameters: {sheet: {columns: 6}, drag: 1}}\n'
        'talker: {ros__parameters: {volume: 11}}\n'
    )
    scene = Scene.from_yaml(path)
    assert (scene.rate, scene.drag) == (30.0, 1.0)
    assert (scene.sheet.rows, scene.sheet.columns) == (4, 6)


@pytest.mark.parametrize('value', ['1:30', '1:' * 180 + '1.5', '1_000', '1_0.5'])
def test_numbers_are_what_ros_reads_as_such(tmp_path, value):
    path = tmp_path / 'scene.yaml'
    path.write_text(f'/**:\n  ros__parameters:\n    rate: {value}\n')
    with pytest.raises(ValueError, match=r"rate is '1.*, but must be a number"):
        Scene.from_yaml(path)


def test_a_path_may_be_bytes_within(tmp_path):
    (tmp_path / 'scene.yaml').write_text('no scene')
    (entry,) = os.scandir(os.fsencode(tmp_path))
    with pytest.raises(ValueError, match=r'scene\.yaml'):
        Scene.from_yaml(entry)
