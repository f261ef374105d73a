"""The room that the node gives Fast DDS for large messages."""

import os
import re
import shutil
from pathlib import Path

import pytest
from ros import NODE

from cloth_ros.node import shared_memory

PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
FREE = 2**25  # bytes


@pytest.fixture(autouse=True)
def unset(monkeypatch, tmp_path):
    """An environment and a folder in which nothing is said of transports, restored afterwards."""
    for name in (PROFILES, 'FASTDDS_BUILTIN_TRANSPORTS'):
        monkeypatch.setenv(name, '')
    monkeypatch.chdir(tmp_path)


def segments(pid: int) -> list[int]:
    """Return the sizes of the segments of shared memory that a process has of Fast DDS, bytes."""
    maps = Path(f'/proc/{pid}/maps').read_text()
    paths = set(re.findall(r'/dev/shm/fastrtps_[0-9a-f]{16}$', maps, re.MULTILINE))
    return [Path(path).stat().st_size for path in paths]


@pytest.mark.parametrize('reach', ['LOCALHOST', 'SUBNET'])
def test_the_node_has_the_room(reach, start):
    if shutil.disk_usage('/dev/shm').free < FREE:
        pytest.skip('little shared memory here')
    node = start(*NODE, ROS_AUTOMATIC_DISCOVERY_RANGE=reach)
    node.wait_for_output('publishing')
    assert max(segments(node.process.pid)) > 2**24


@pytest.mark.parametrize(
    ('name', 'value'), [(PROFILES, 'mine.xml'), ('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')]
)
def test_what_the_user_has_set_is_kept(name, value, monkeypatch):
    monkeypatch.setenv(name, value)
    before = dict(os.environ)
    shared_memory.enlarge_shared_memory()
    assert dict(os.environ) == before


def test_profiles_in_the_folder_are_kept(tmp_path):
    (tmp_path / 'DEFAULT_FASTRTPS_PROFILES.xml').touch()
    shared_memory.enlarge_shared_memory()
    assert not os.environ[PROFILES]


@pytest.mark.parametrize('folder', ['/no/such/folder', '/sys'])
def test_little_or_no_shared_memory_is_left_to_others(folder, monkeypatch):
    monkeypatch.setattr(shared_memory, '_FOLDER', folder)
    shared_memory.enlarge_shared_memory()
    assert not os.environ[PROFILES]
