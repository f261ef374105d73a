"""Enlarge the shared memory in which Fast DDS carries large messages."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

_PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
# Transports that the user has chosen are not changed.
_TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'
_PROFILES_HERE = Path('DEFAULT_FASTRTPS_PROFILES.xml')
_FOLDER = '/dev/shm'
SEGMENT = 16 * 2**20  # bytes, as in the profile
# Containers often have little, and other processes need some.
_LEAST_FREE = 2 * SEGMENT  # bytes


def enlarge_shared_memory() -> None:
    """
    Have Fast DDS use a larger segment for what it sends; to be called before `rclpy.init`.

    By default the segment has half a megabyte, which the markers of a sheet of 60 × 60 particles
    fill.  While one subscriber hangs, or was killed, the messages that wait for it occupy the
    space of those for the others: from 48 × 48 particles on, these received nothing for seconds,
    some of them until it went on.  Settings of the user are kept.
    """
    if os.environ.get(_PROFILES) or os.environ.get(_TRANSPORTS) or _PROFILES_HERE.exists():
        return
    try:
        free = shutil.disk_usage(_FOLDER).free
    except OSError:  # not Linux
        return
    if free >= _LEAST_FREE:
        os.environ[_PROFILES] = str(Path(__file__).with_name('fastdds.xml'))
