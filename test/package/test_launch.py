"""The launch file: what it refuses before it starts anything, and what it starts."""

import os
import re
import sys

import pytest
from ros import ROOT

from cloth_ros.node.launch_checks import check_launch, recorded_topics

SCENE = str(ROOT / 'config' / 'hanging.yaml')
NO_SCENE = "scene is 'no.yaml', but must be the path of a file; correct the path"
NO_RVIZ = (
    'rviz is True, but must be false where RViz is not installed; '
    'install it (apt install ros-jazzy-rviz2), or leave out rviz:=true'
)


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    """The only ament prefix, without packages."""
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')
    return tmp_path


def install(prefix, package: str, executable: str, script: str) -> None:
    """Install an executable as `ros2 run` looks for it."""
    index = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / package
    path = prefix / 'lib' / package / executable
    for file, text in ((index, ''), (path, f'#!/bin/sh\n{script}\n')):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    path.chmod(0o755)
    (prefix / 'share' / package).mkdir(exist_ok=True)


def test_a_scene_that_is_no_file_is_refused(tmp_path):
    check_launch(SCENE)
    for scene, text in (
        ('no.yaml', NO_SCENE),
        ('', "scene is '', but must be the path of a file"),
        (str(tmp_path), 'not a regular file but a folder'),
        (f'{SCENE}/x', 'Not a directory; give a file'),
    ):
        with pytest.raises(ValueError, match=re.escape(text)) as refusal:
            check_launch(scene)
        assert str(refusal.value).isprintable()


@pytest.mark.parametrize(
    ('wanted', 'installed', 'remedy'),
    [
        ('viewer', ('cloth_ros', 'cloth_viewer'), "pip install 'cloth_ros[viewer]'"),
        ('rviz', ('rviz2', 'rviz2'), 'apt install ros-jazzy-rviz2'),
        ('record', ('ros2bag', 'unused'), 'apt install ros-jazzy-rosbag2'),
    ],
)
def test_what_is_not_installed_is_refused(wanted, installed, remedy, prefix, monkeypatch):
    on_path = prefix / 'bin' / 'ros2'
    monkeypatch.setenv('PATH', str(on_path.parent))
    for path in (str(prefix), ''):
        monkeypatch.setenv('AMENT_PREFIX_PATH', path)
        check_launch(SCENE)
        text = rf'{wanted} is True, but must be false .*; install it \({re.escape(remedy)}\)'
        with pytest.raises(ValueError, match=text):
            check_launch(SCENE, [wanted])
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    install(prefix, *installed, 'exit')
    on_path.parent.mkdir()
    on_path.touch(0o755)
    check_launch(SCENE, [wanted])


def test_the_recording_has_a_folder_of_its_own_and_every_command(prefix, tmp_path, monkeypatch):
    install(prefix, 'ros2bag', 'unused', 'exit')
    install(prefix, 'ros2', 'ros2', 'exit')
    monkeypatch.setenv('PATH', str(prefix / 'lib' / 'ros2'))
    check_launch(SCENE, ['record'], str(tmp_path / 'new'))
    check_launch(SCENE, [], str(tmp_path))
    with pytest.raises(ValueError, match='but must be a folder that does not exist yet'):
        check_launch(SCENE, ['record'], str(tmp_path))
    outputs = [f'/cloth/{name}' for name in ('particles', 'ticks', 'keyframes', 'scene')]
    commands = ['/wind', '/sphere_pose', '/box/pose']
    topics = ['/diagnostics', '/parameter_events', *outputs, *commands]
    box = str(ROOT / 'config' / 'box.yaml')
    assert recorded_topics(box, '') == recorded_topics(box, '/') == topics
    within = [*topics[:2], *(f'/lab{topic}' for topic in topics[2:])]
    assert recorded_topics(box, 'lab') == recorded_topics(box, '/lab') == within


LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource

source = PythonLaunchDescriptionSource('launch/cloth.launch.py')
arguments = [argument.split(':=') for argument in sys.argv[1:]]
service = LaunchService()
service.include_launch_description(IncludeLaunchDescription(source, launch_arguments=arguments))
sys.exit(service.run())
"""


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (('scene:=no.yaml',), NO_SCENE),
        ((f'scene:={SCENE}', 'rviz:=true'), NO_RVIZ),
        ((f'scene:={SCENE}',), ''),
        ((f'scene:={SCENE}', 'record:=true'), 'install it (apt install ros-jazzy-rosbag2)'),
        ((f'scene:={SCENE}', 'rviz:=true', 'viewer:=true', 'record:=true', 'bag:=b'), ''),
    ],
)
def test_the_launch_file_starts_all_or_nothing(arguments, text, prefix, start, monkeypatch):
    """With the real launch, and scripts in place of the programs that it starts."""
    pytest.importorskip('launch_ros', reason='launch is not installed')
    install(prefix, 'cloth_ros', 'cloth_node', 'echo started a cloth: "$@"')
    if not text:
        install(prefix, 'cloth_ros', 'cloth_viewer', 'exit')
        install(prefix, 'rviz2', 'rviz2', 'exit')
        install(prefix, 'ros2bag', 'unused', 'exit')
        install(prefix, 'ros2', 'ros2', 'echo recorded: "$@"')
        monkeypatch.setenv('PATH', f'{prefix}/lib/ros2:{os.environ["PATH"]}')
    launch = start(sys.executable, '-c', LAUNCH, *arguments)
    assert launch.stop(0) == bool(text), launch.output
    errors = [line for line in launch.output.splitlines() if '[ERROR]' in line]
    assert len(errors) == bool(text)
    assert all(text in line for line in errors)
    started = re.findall(r'\[(\w+)-\d\]: process started', launch.output)
    expected = ['cloth_node', *(['cloth_viewer', 'rviz2', 'record'] if len(arguments) > 2 else [])]
    assert started == ([] if text else expected)
    assert text or f'--params-file {SCENE}' in launch.output
    recorded = 'recorded: bag record --output b --topics /diagnostics /parameter_events /cloth/'
    assert (recorded in launch.output) == ('record' in started)
