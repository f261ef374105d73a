"""Scenes in ROS parameter files; `reliability/test_fuzz_files.py` has damaged ones."""

import os
import re

import pytest
import yaml

from cloth_ros import Scene


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('', 'no parameters for the node'),
        ('[', 'not YAML'),
        ('other: {ros__parameters: {rate: 5.0}}', 'no parameters for the node'),
        ('cloth: {ros__parameters: 3}', 'ros__parameters of /cloth is 3'),
        ('/lab/**: {ros__parameters: {rate: 9}}', '/lab/** is no name of a node that ROS reads'),
        ('"/**": {ros__parameters: {rate: !!python/object/apply:os.getcwd []}}', 'a tag'),
        ('"/**": {ros__parameters: {rat: 60.0}}', "did you mean 'rate'"),
        # These are strings for ROS.
        *(
            (f'"/**": {{ros__parameters: {{rate: {value}}}}}', "rate is '1")
            for value in ('1:30', '1:' * 180 + '1.5', '1_000', '1_0.5')
        ),
    ],
)
def test_a_file_without_a_valid_scene_is_refused_in_one_line(tmp_path, text, reason):
    path = tmp_path / 'scene.yaml'
    path.write_text(text)
    (as_bytes,) = os.scandir(os.fsencode(tmp_path))
    for given in (path, as_bytes):
        with pytest.raises(ValueError, match=r'scene\.yaml: [^\n]*$') as refusal:
            Scene.from_yaml(given)
        assert reason in str(refusal.value)


def test_a_file_may_name_the_node_and_set_parameters_of_every_node(tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text(
        '/**: {ros__parameters: {use_sim_time: true, rate: 30, sheet.rows: 4}}\n'
        '/lab/cloth: {ros__parameters: {sheet: {columns: 6}, drag: 1}}\n'
        'talker: {ros__parameters: {volume: 11}}\n'
    )
    scene = Scene.from_yaml(path)
    assert (scene.rate, scene.drag, scene.sheet.rows, scene.sheet.columns) == (30.0, 1.0, 4, 6)


def test_a_saved_scene_has_what_differs_from_the_defaults(tmp_path):
    path = tmp_path / 'scene.yaml'
    box = {'type': 'box', 'size': (1, 1, 0.1)}
    scene = Scene(pins=(), solver={'tolerance': 1e-5}, collider={'names': ['floor'], 'floor': box})
    scene.to_yaml(path)
    # As PyYAML reads it, and so `ros2 param load`.
    assert yaml.safe_load(path.read_text())['/**']['ros__parameters'] == {
        'rate': 60.0,
        'pins': [''],
        'solver': {'tolerance': 1e-5},
        'collider': {'names': ['floor'], 'floor': {'type': 'box', 'size': [1.0, 1.0, 0.1]}},
    }
    assert Scene.from_yaml(path) == scene


def test_a_scene_that_cannot_be_saved_is_refused_and_leaves_no_file(tmp_path):
    path = tmp_path / 'scene.yaml'
    many = Scene(pins=[f'0,{"0" * 60}{i % 1000}' for i in range(4096)], sheet={'columns': 1000})
    with pytest.raises(ValueError, match='at most 200000; write slices'):
        many.to_yaml(path)
    with pytest.raises(ValueError, match='the path is 3, but must be a string or a path'):
        many.to_yaml(3)
    with pytest.raises(FileNotFoundError):
        Scene().to_yaml(tmp_path / 'no' / 'scene.yaml')
    assert not path.exists()


RATE = '{ros__parameters: {rate: 9}}'
# A file that is refused, what the error advises, and the file after that.
REMEDIES = [
    (
        f'/**: {RATE[:-2]}, drag: &x 1, sphere.friction: *x}}}}',
        'an alias in line 1; write the value out',
        f'/**: {RATE[:-2]}, drag: &x 1, sphere.friction: 1}}}}',
    ),
    ('/**: {ros__parameters: {rate: !!int 9}}', 'a tag in line 1; leave it out', f'/**: {RATE}'),
    (f'/**: {RATE[:-2]},\n rate: 8}}}}', 'again in line 2; leave one out', f'/**: {RATE}'),
    (f'/**: {RATE[:-1]}', 'correct its syntax', f'/**: {RATE}'),
    (RATE, "begins with '/**:' and, indented below it, 'ros__parameters:'", f'/**: {RATE}'),
    (f'talker: {RATE}', 'only for /talker; write /** instead', f'/**: {RATE}'),
    (f'/lab/**: {RATE}', '; write /**', f'/**: {RATE}'),
    (f'/*/cloth: {RATE}', '; write /**/cloth', f'/**/cloth: {RATE}'),
    (f'/a/cloth: {RATE}\nb/cloth: {RATE}', ', /b/cloth; give each a file', f'/a/cloth: {RATE}'),
    ('cloth: {ros__parameters: }', '; write rate: 60.0 below it', f'cloth: {RATE}'),
    ('cloth: {ros__parameters: {rates: 9}}', "; did you mean 'rate'?", f'cloth: {RATE}'),
]


@pytest.mark.parametrize(('text', 'remedy', 'remedied'), REMEDIES)
def test_the_remedies_for_files_succeed(text, remedy, remedied, tmp_path):
    path = tmp_path / 'scene.yaml'
    path.write_text(text)
    with pytest.raises(ValueError, match=f'{re.escape(remedy)}$'):
        Scene.from_yaml(path)
    path.write_text(remedied)
    assert Scene.from_yaml(path).rate == 9.0
