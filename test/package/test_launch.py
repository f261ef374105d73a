"""The launch file: what it refuses before it starts anything, and what it starts."""

import re
import sys

import pytest
from ros import ROOT

from cloth_ros.node.launch_checks import check_launch

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
    check_launch(SCENE, rviz=False)
    for scene, text in (
        ('no.yaml', NO_SCENE),
        ('', "scene is '', but must be the path of a file"),
        (str(tmp_path), 'not a regular file but a folder'),
        (f'{SCENE}/x', 'Not a directory; give a file'),
    ):
        with pytest.raises(ValueError, match=re.escape(text)) as refusal:
            check_launch(scene, rviz=False)
        assert str(refusal.value).isprintable()


def test_rviz_that_is_not_installed_is_refused(prefix, monkeypatch):
    for path in (str(prefix), ''):
        monkeypatch.setenv('AMENT_PREFIX_PATH', path)
        check_launch(SCENE, rviz=False)
        with pytest.raises(ValueError, match=re.escape(NO_RVIZ)):
            check_launch(SCENE, rviz=True)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    install(prefix, 'rviz2', 'rviz2', 'exit')
    check_launch(SCENE, rviz=True)


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
        ((f'scene:={SCENE}', 'rviz:=true', 'installed'), ''),
    ],
)
def test_the_launch_file_starts_all_or_nothing(prefix, start, arguments, text):
    """With the real launch, and scripts in place of the programs that it starts."""
    pytest.importorskip('launch_ros', reason='launch is not installed')
    install(prefix, 'cloth_ros', 'cloth_node', 'echo started a cloth: "$@"')
    if arguments[-1] == 'installed':
        install(prefix, 'rviz2', 'rviz2', 'exit')
        arguments = arguments[:-1]
    launch = start(sys.executable, '-c', LAUNCH, *arguments)
    assert launch.stop(0) == bool(text), launch.output
    errors = [line for line in launch.output.splitlines() if '[ERROR]' in line]
    assert len(errors) == bool(text)
    assert all(text in line for line in errors)
    started = re.findall(r'\[(\w+)-\d\]: process started', launch.output)
    expected = ['cloth_node', *(['rviz2'] if 'rviz:=true' in arguments else [])]
    assert started == ([] if text else expected)
    assert text or f'--params-file {SCENE}' in launch.output
