"""Checks of the launch file before it starts anything, and what it records."""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection
from pathlib import Path

from ament_index_python.packages import get_package_prefix

from ..scene import Scene
from ..scene.parameter import invalid_value_error
from ..scene.parameter_file import format_path, read_limited

_READY = 'scene:=$(ros2 pkg prefix --share cloth_ros)/config/gust.yaml'
# Of what can be started beside the node: package, executable if there is one, name for people,
# and how it is installed.
_PROGRAMS = {
    'viewer': ('cloth_ros', 'cloth_viewer', 'the viewer', "pip install 'cloth_ros[viewer]'"),
    'rviz': ('rviz2', 'rviz2', 'RViz', 'apt install ros-{distro}-rviz2'),
    'record': ('ros2bag', '', 'ros2 bag', 'apt install ros-{distro}-rosbag2'),
}


def check_launch(scene: str, wanted: Collection[str] = (), bag: str = '') -> None:
    """
    Check what the processes to be launched need.

    Parameters
    ----------
    scene
        Path of the scene file.
    wanted
        What is to be started beside the node: 'viewer', 'rviz', 'record'.
    bag
        Folder of the recording; empty: a new one.

    Raises
    ------
    ValueError
        The scene is not a file that can be read, a program is not installed, or the folder of the
        recording is there already.

    """
    try:
        read_limited(scene)
    except FileNotFoundError:
        remedy = f'correct the path, or take a ready one: {_READY}'
        raise invalid_value_error('scene', scene, 'the path of a file', remedy) from None
    except OSError as error:
        raise ValueError(f'scene {format_path(scene)}: {error.strerror}; give a file') from None
    except ValueError as error:
        raise ValueError(f'scene {format_path(scene)}: {error}') from None
    for argument in wanted:
        package, executable, name, install = _PROGRAMS[argument]
        if not _is_installed(package, executable):
            install = install.format(distro=os.environ.get('ROS_DISTRO', 'jazzy'))
            raise invalid_value_error(
                argument, True, f'false where {name} is not installed',
                f'install it ({install}), or leave out {argument}:=true',
            )  # fmt: skip
    if bag and 'record' in wanted and os.path.lexists(bag):
        raise invalid_value_error(
            'bag', bag, 'a folder that does not exist yet', 'give another name'
        )


def recorded_topics(scene: str, namespace: str) -> list[str]:
    """
    Return the topics to record: what cloth_resimulate needs, diagnostics and all commands.

    Parameters
    ----------
    scene
        Path of the scene file, whose colliders and grippers have topics for commands.
    namespace
        Of the node.

    Raises
    ------
    ValueError
        The scene is not valid.

    """
    names = [name for group in Scene.from_yaml(scene).named_groups for name in group.names]
    within = f'/{namespace.strip("/")}'.rstrip('/')
    outputs = (f'cloth/{name}' for name in ('particles', 'ticks', 'keyframes', 'scene'))
    relative = (*outputs, 'wind', 'sphere_pose', *(f'{name}/pose' for name in names))
    return ['/diagnostics', '/parameter_events', *(f'{within}/{topic}' for topic in relative)]


def _is_installed(package: str, executable: str) -> bool:
    """Return whether `ros2 run` finds an executable, or ros2 a package without one."""
    try:
        prefix = Path(get_package_prefix(package))
    except (LookupError, OSError):  # OSError: AMENT_PREFIX_PATH is not set
        return False
    if not executable:
        return shutil.which('ros2') is not None
    return os.access(prefix / 'lib' / package / executable, os.X_OK)
