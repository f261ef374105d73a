"""Scenes in ROS parameter files."""

import os

import pytest

from cloth_ros import Scene


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
def test_a_file_without_a_scene_is_refused_in_one_line(tmp_path, text):
    path = tmp_path / 'scene.yaml'
    path.write_text(text)
    (as_bytes,) = os.scandir(os.fsencode(tmp_path))
    for given in (path, as_bytes):
        with pytest.raises(ValueError, match=r'scene\.yaml') as refusal:
            Scene.from_yaml(given)
        assert '\n' not in str(refusal.value)


def test_a_file_may_name_the_node_and_set_parameters_of_every_node(tmp_path):
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
def test_only_what_ros_reads_as_a_number_is_one(tmp_path, value):
    path = tmp_path / 'scene.yaml'
    path.write_text(f'/**:\n  ros__parameters:\n    rate: {value}\n')
    with pytest.raises(ValueError, match=r"rate is '1.*, but must be a number"):
        Scene.from_yaml(path)
