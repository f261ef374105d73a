"""Check the command line, and explain errors in it in one line."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.utilities import remove_ros_args

from ..scene.parameter import invalid_value_error, one_line
from ..scene.parameter_file import read_limited

_LONGEST = 600  # characters of an explanation


def check_files(arguments: Sequence[str]) -> None:
    """Raise ValueError for parameter files at which rcl would block, or that are too large."""
    for flag, path in pairwise(arguments):
        if flag == '--params-file':
            try:
                read_limited(path)
            except OSError as error:
                raise ValueError(f'{path}: {error.strerror}; give a file') from None
            except ValueError as error:
                raise ValueError(f'{path}: {error}') from None


def check_rest(arguments: Sequence[str]) -> None:
    """Raise ValueError if there are arguments that are not for ROS."""
    rest = remove_ros_args(list(arguments))
    if rest:
        remedy = 'give a scene by --ros-args --params-file SCENE; see cloth_node --help'
        raise invalid_value_error('an argument', rest[0], 'one for ROS, behind --ros-args', remedy)


def explanation(error: Exception) -> str:
    """Return one line about arguments that the scene or rcl rejects."""
    text = one_line(str(error))
    if isinstance(error, rclpy_implementation.UnknownROSArgsError):
        text = f'unknown ROS arguments {text}; leave them out'
    elif 'PARAMETER_NOT_SET' in text:
        text = f'{text}; an empty list has no type: for no pins, write pins: [""]'
    return text if len(text) <= _LONGEST else f'{text[:_LONGEST]} …'
