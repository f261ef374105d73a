"""Room in shared memory for large messages, where Fast DDS carries them."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

_PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
# Whoever says how messages are to be carried is left alone.
_TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'
_PROFILES_HERE = Path('DEFAULT_FASTRTPS_PROFILES.xml')
_FOLDER = '/dev/shm'
# Twice the segment that the profile asks for: containers often have little, which others need too.
_LEAST_FREE = 2 * 16 * 2**20  # bytes


def enlarge_shared_memory() -> None:
    """
    Have Fast DDS keep what it sends in a larger segment; to be called before `rclpy.init`.

    By default it has half a megabyte, the markers of a sheet of 60 × 60 particles.  While one
    subscriber hangs, or is gone without a goodbye, what waits for it takes the place of what the
    others are to hear: from 48 × 48 on they then heard nothing for seconds, some of them until it
    went on.  What the user has set is kept.
    """
    if os.environ.get(_PROFILES) or os.environ.get(_TRANSPORTS) or _PROFILES_HERE.exists():
        return
    try:
        free = shutil.disk_usage(_FOLDER).free
    except OSError:  # not Linux
        return
    if free >= _LEAST_FREE:
        os.environ[_PROFILES] = str(Path(__file__).with_name('fastdds.xml'))
