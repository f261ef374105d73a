"""
Read an SQLite file of rosbag2, also one that is not complete.

A recorder that was killed may leave a file without its end, or messages that are only in the
write-ahead log beside it.  rosbags leaves out the log, and finds messages by an index of their
times, the parts of which may be anywhere in the file.  Here they are read in the order in which
they were written, with those in the log, up to the first part that is missing.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import NamedTuple

# What SQLite keeps beside a file until a transaction is complete: new contents, or former ones.
_LOG, _JOURNAL = '-wal', '-journal'


class Topic(NamedTuple):
    """Name and type of a topic."""

    name: str
    type: str


def unfinished(path: Path) -> str:
    """Return in words what the recorder has left beside a file; empty if nothing."""
    left = [beside.name for beside in (_log(path), _beside(path, _JOURNAL)) if beside is not None]
    return f'{" and ".join(left)} is left, the recorder was killed' if left else ''


def _beside(path: Path, suffix: str) -> Path | None:
    """Return a file of SQLite's beside another one; None if it is missing or empty."""
    found = path.with_name(path.name + suffix)
    return found if found.exists() and found.stat().st_size > 0 else None


def _log(path: Path) -> Path | None:
    return _beside(path, _LOG)


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """
    Open a file for reading; nothing is written, neither to it nor beside it.

    A journal is ignored: with it, SQLite would undo what was written last.
    """
    how = 'immutable=1' if _log(path) is None else 'mode=ro&vfs=unix-none'
    with closing(sqlite3.connect(f'{path.resolve().as_uri()}?{how}', uri=True)) as connection:
        # Then the index of the log is in memory, and not in a file that SQLite would have to make.
        connection.execute('PRAGMA locking_mode = EXCLUSIVE')
        # Otherwise a file is refused that is shorter than its first page says.
        connection.execute('PRAGMA writable_schema = ON')
        yield connection


def read_topics(path: Path) -> dict[int, Topic]:
    """Return the topics of a file by number; raises sqlite3.Error if it has none."""
    with _opened(path) as connection:
        rows = connection.execute('SELECT id, name, type FROM topics').fetchall()
    return {number: Topic(name, kind) for number, name, kind in rows}


def count_messages(path: Path) -> dict[int, int]:
    """Return how many messages there are by topic; raises sqlite3.Error for a damaged file."""
    with _opened(path) as connection:
        rows = connection.execute('SELECT topic_id, count(*) FROM messages GROUP BY topic_id')
        return dict(rows.fetchall())


def read_messages(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """
    Yield number of the topic, time of reception, ns, and data of each message.

    Raises
    ------
    sqlite3.Error
        What follows is missing or damaged.

    """
    with _opened(path) as connection:
        # As they were written; without NOT INDEXED the order might be taken from the index.
        yield from connection.execute(
            'SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id'
        )
