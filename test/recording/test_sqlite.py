"""SQLite bags whose recorder was killed, and truncated ones: what is there is read."""

import shutil
import sqlite3

import pytest
from builders import scene_of
from recordings import record
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from cloth_ros.recording import run
from cloth_ros.recording.bag import Bag
from cloth_ros.recording.main import main

TICKS = 60
SCENE = scene_of(sheet__rows=24, sheet__columns=24)
LOGGED = 30  # ticks whose messages are in the write-ahead log


def repeat(path):
    return run.repeat(path, None, lambda *_: None)


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Write a complete bag."""
    folder = tmp_path_factory.mktemp('sqlite')
    source = record(folder / 'mcap', SCENE, TICKS, lambda live, tick: live.set_wind((0, tick, 0)))
    types = get_typestore(Stores.ROS2_JAZZY)
    with Writer(folder / 'bag', version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {}
        for message in Bag(source).messages():
            if message.topic not in connections:
                connections[message.topic] = writer.add_connection(
                    message.topic, message.type, typestore=types
                )
            writer.write(connections[message.topic], message.received, message.data)
    return folder / 'bag'


def copied(bag, folder):
    """Return the file of a copy of a bag without metadata, as a recorder leaves it if killed."""
    shutil.copytree(bag, folder / 'bag')
    (folder / 'bag/metadata.yaml').unlink()
    return folder / 'bag/bag.db3'


def test_a_truncated_file_is_read_up_to_its_end(bag, tmp_path, capsys):
    file = copied(bag, tmp_path)
    whole = file.read_bytes()
    assert repeat(file.parent).result['ticks'] == TICKS - 1
    for share in (0.95, 0.6, 0.3):
        file.write_bytes(whole[: round(share * len(whole))])
        outcome = repeat(file.parent)
        assert outcome.identical
        assert 0.6 * share * TICKS < outcome.result['ticks'] < TICKS - 1
        assert outcome.lines[-1].startswith('bag.db3 ends after the message at ')
    for size in (5000, 100, 0):  # not even the topics
        file.write_bytes(whole[:size])
        assert main([str(file.parent)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert 'bag.db3' in line


@pytest.fixture
def logged(bag, tmp_path):
    """Return a file of which the last messages are in its log only, and the log."""
    file = copied(bag, tmp_path / 'complete')
    (tmp_path / 'bag').mkdir()
    with sqlite3.connect(file, isolation_level=None) as database:
        last = database.execute('SELECT id FROM messages ORDER BY id DESC').fetchone()[0]
        rows = database.execute(
            'SELECT * FROM messages WHERE id > ? ORDER BY id', (last - 2 * LOGGED,)
        ).fetchall()
        database.execute('DELETE FROM messages WHERE id > ?', (last - 2 * LOGGED,))
        database.execute('VACUUM')
        database.execute('PRAGMA journal_mode = WAL')
        database.execute('PRAGMA wal_autocheckpoint = 0')
        for row in rows:
            database.execute('INSERT INTO messages VALUES (?, ?, ?, ?)', row)
        for each in (file, file.with_name('bag.db3-wal')):  # as they are while it is recorded
            shutil.copy(each, tmp_path / 'bag' / each.name)
    return tmp_path / 'bag/bag.db3', tmp_path / 'bag/bag.db3-wal'


def test_messages_in_the_log_of_a_killed_recorder_are_read(logged):
    file, log = logged
    before = file.read_bytes(), log.read_bytes()
    outcome = repeat(file.parent)
    assert outcome.identical
    assert outcome.result['ticks'] == TICKS - 1
    assert any(f'{log.name} is left, the recorder was killed' in line for line in outcome.lines)
    assert (file.read_bytes(), log.read_bytes()) == before
    assert set(file.parent.iterdir()) == {file, log}


def test_a_truncated_log_is_read_up_to_its_last_whole_message(logged):
    file, log = logged
    whole = log.read_bytes()
    log.write_bytes(whole[: len(whole) // 2])
    outcome = repeat(file.parent)
    assert outcome.identical
    assert TICKS - 0.7 * LOGGED < outcome.result['ticks'] < TICKS - 0.3 * LOGGED
    log.write_bytes(whole[:20])
    assert repeat(file.parent).result['ticks'] == TICKS - LOGGED - 1


def test_a_file_in_the_middle_of_a_transaction_is_read(bag, tmp_path):
    """Of a recorder that was killed before it committed: a journal would undo all of it."""
    file = copied(bag, tmp_path / 'complete')
    (tmp_path / 'bag').mkdir()
    with sqlite3.connect(file, isolation_level=None) as database:
        database.execute('PRAGMA cache_size = 2')  # written before the end of the transaction
        database.execute('BEGIN')
        rows = database.execute('SELECT topic_id, timestamp, data FROM messages').fetchall()
        insert = 'INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)'
        for again in (1, 2):
            for topic, time, data in rows:
                database.execute(insert, (topic, time + again * 10**10, data))
        for name in ('bag.db3', 'bag.db3-journal'):
            shutil.copy(file.with_name(name), tmp_path / 'bag' / name)
        database.execute('ROLLBACK')
    outcome = repeat(tmp_path / 'bag')
    assert outcome.identical
    assert outcome.result['ticks'] >= TICKS - 1
    assert any('bag.db3-journal is left' in line for line in outcome.lines)
