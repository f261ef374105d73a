"""Check whether log files can be written."""

from __future__ import annotations

import tempfile

from rclpy.logging import get_logging_directory

# rcl refuses to start if it cannot write its log file; with these arguments it writes none.
WITHOUT_FILES = ['--ros-args', '--disable-external-lib-logs']


def obstacle() -> str:
    """Return why no log file can be written; empty if one can."""
    try:
        folder = get_logging_directory()
    except RuntimeError:
        return 'neither ROS_LOG_DIR nor HOME is set'
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return ''
    except OSError as error:
        return str(error)
