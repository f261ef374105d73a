"""Check the command line, and explain errors in it in one line."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.utilities import remove_ros_args

from ..scene.parameter import invalid_value_error, one_line

_LONGEST = 600  # characters of an explanation


def check_rest(arguments: Sequence[str]) -> None:
    """Raise ValueError if there are arguments that are not for ROS."""
    rest = remove_ros_args(list(arguments))
    if rest:
        scene = rest[0] if rest[0].endswith(('.yaml', '.yml')) else 'SCENE'
        remedy = f'give a scene so: cloth_node --ros-args --params-file {shlex.quote(scene)}'
        raise invalid_value_error('an argument', rest[0], 'one for ROS, behind --ros-args', remedy)


def explanation(error: Exception) -> str:
    """Return one line about arguments that the scene or rcl rejects."""
    text = one_line(str(error))
    if isinstance(error, rclpy_implementation.UnknownROSArgsError):
        text = f'unknown ROS arguments {text}; leave them out'
    return text if len(text) <= _LONGEST else f'{text[:_LONGEST]} …'
