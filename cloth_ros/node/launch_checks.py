"""Checks of the launch file, before it starts anything."""

from __future__ import annotations

import os
from pathlib import Path

from ament_index_python.packages import get_package_prefix

from ..scene.parameter import invalid_value_error
from ..scene.parameter_file import format_path, read_limited

_READY = 'scene:=$(ros2 pkg prefix --share cloth_ros)/config/gust.yaml'


def check_launch(scene: str, *, rviz: bool) -> None:
    """
    Check what the nodes to be launched need.

    Parameters
    ----------
    scene
        Path of the scene file.
    rviz
        True if RViz is to be started.

    Raises
    ------
    ValueError
        The scene is not a file that can be read, or RViz is not installed.

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
    if rviz and not _is_installed('rviz2', 'rviz2'):
        package = f'ros-{os.environ.get("ROS_DISTRO", "jazzy")}-rviz2'
        raise invalid_value_error(
            'rviz', True, 'false where RViz is not installed',
            f'install it (apt install {package}), or leave out rviz:=true',
        )  # fmt: skip


def _is_installed(package: str, executable: str) -> bool:
    """Return whether `ros2 run` finds an executable."""
    try:
        prefix = Path(get_package_prefix(package))
    except (LookupError, OSError):  # OSError: AMENT_PREFIX_PATH is not set
        return False
    return os.access(prefix / 'lib' / package / executable, os.X_OK)
