"""The package as colcon builds it, with colcon from PyPI."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ros import ROOT
from sensor_msgs.msg import PointCloud2

pytestmark = pytest.mark.slow

COLCON = Path(sys.executable).parent / 'colcon'


@pytest.fixture(scope='module')
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A colcon workspace in which the package is built from what git would carry."""
    workspace = tmp_path_factory.mktemp('workspace')
    source = workspace / 'src' / 'cloth_ros'
    ignored = shutil.ignore_patterns(
        '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'parts'
    )
    shutil.copytree(ROOT, source, ignore=ignored)
    variables = {**os.environ, 'COLCON_LOG_PATH': str(workspace / 'log')}
    # As a shell that has sourced ROS 2: the environment of the wheels is such a prefix.
    variables['AMENT_PREFIX_PATH'] = sys.prefix
    listing = subprocess.run(
        [COLCON, 'list', '--base-paths', 'src'],
        cwd=workspace,
        env=variables,
        text=True,
        capture_output=True,
        check=True,
    ).stdout
    assert '(ros.ament_python)' in listing
    built = subprocess.run(
        [COLCON, 'build', '--base-paths', 'src', '--event-handlers', 'console_cohesion+'],
        cwd=workspace,
        env=variables,
        text=True,
        capture_output=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return workspace


def test_the_files_are_where_ros_looks_for_them(workspace):
    prefix = workspace / 'install' / 'cloth_ros'
    share = prefix / 'share' / 'cloth_ros'
    index = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / 'cloth_ros'
    assert index.exists()
    assert (share / 'package.xml').exists()
    for folder, pattern in (('config', '*'), ('launch', '*.launch.py')):
        expected = {path.name for path in (ROOT / folder).glob(pattern)}
        assert {path.name for path in (share / folder).iterdir()} == expected
    assert os.access(prefix / 'lib' / 'cloth_ros' / 'cloth_node', os.X_OK)


def test_the_built_executable_runs(workspace, start, probe):
    install = workspace / 'install'
    executable = install / 'cloth_ros' / 'lib' / 'cloth_ros' / 'cloth_node'
    scene = install / 'cloth_ros' / 'share' / 'cloth_ros' / 'config' / 'hanging.yaml'
    node = start(
        'bash',
        '-c',
        f'. {install}/setup.bash && cd {workspace} && '
        'python -c "import cloth_ros; print(cloth_ros.__file__)" && '
        f'exec {executable} --ros-args --params-file {scene}',
        AMENT_PREFIX_PATH=sys.prefix,
        PATH=f'{Path(sys.executable).parent}:{os.environ["PATH"]}',
    )
    node.wait_for_output('publishing')
    assert f'{install}/cloth_ros/lib' in node.output  # and not the source tree
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(particles) > 10)
    assert particles[0].width == 32
    assert node.stop() == 0


def test_the_built_study_runs(workspace, tmp_path):
    install = workspace / 'install'
    scene = tmp_path / 'tiny.yaml'
    scene.write_text('/**:\n  ros__parameters:\n    sheet: {rows: 4, columns: 4}\n')
    done = subprocess.run(
        [
            'bash',
            '-c',
            f'. {install}/setup.bash && '
            f'{install}/cloth_ros/lib/cloth_ros/cloth_tradeoff {scene} --quick --seconds 0.1',
        ],
        cwd=tmp_path,
        env={
            **os.environ,
            'AMENT_PREFIX_PATH': sys.prefix,
            'PATH': f'{Path(sys.executable).parent}:{os.environ["PATH"]}',
        },
        text=True,
        capture_output=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert '60 Hz on this machine' in done.stdout
    assert (tmp_path / 'tradeoff' / 'tiny' / 'report.md').exists()
