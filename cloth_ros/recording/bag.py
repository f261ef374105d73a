"""Read the messages of a bag, as far as it can be read."""

from __future__ import annotations

import re
import sqlite3
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from mcap.reader import NonSeekingReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from ..scene.parameter import one_line
from .sqlite_file import count_messages, read_messages, read_topics, unfinished

_METADATA = 'metadata.yaml'
_STORAGES = ('.mcap', '.db3')
_MOST_DEFECTS = 100


class Message(NamedTuple):
    """
    A message of a bag.

    Attributes
    ----------
    topic, type
        Names.
    received
        When the recorder received it, ns.
    data
        Serialised message (CDR).

    """

    topic: str
    type: str
    received: int
    data: bytes


# Names and types of messages, as ROS has them.
TYPESTORE = get_typestore(Stores.ROS2_JAZZY)


def _reason(error: BaseException) -> str:
    """Return why something failed, in one line; some errors of the libraries have no text."""
    return one_line(str(error)) or type(error).__name__


def _files(folder: Path) -> list[Path]:
    """Return the files of a bag in their order: `bag_2.mcap` before `bag_10.mcap`."""

    def order(file: Path) -> list[object]:
        parts = re.split(r'(\d+)', file.name)
        return [(int(part), '') if part.isdecimal() else (-1, part) for part in parts]

    files = [file for file in folder.iterdir() if file.suffix in _STORAGES]
    return sorted(files, key=order)


def is_bag(folder: Path) -> bool:
    """Return whether a folder is a bag, complete or not."""
    return (folder / _METADATA).exists() or bool(_files(folder))


class Bag:
    """
    A bag of rosbag2, MCAP or SQLite, which is read as a stream.

    Parameters
    ----------
    path
        Folder of the bag, or one of its files.

    Attributes
    ----------
    topics
        Types by topic; known before all has been read where the bag has an index.
    count
        Number of messages by topic; empty where the bag has no index.

    Raises
    ------
    ValueError
        There is no bag, or nothing of it can be read.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, str] = {}
        self.count: dict[str, int] = defaultdict(int)
        self._defects: Counter[str] = Counter()
        self._parts = [part for found in self._find_parts() for part in self._readable(found)]
        if not self._parts:
            raise ValueError(f'{path} cannot be read: {"; ".join(self.defects)}')
        self._defects_of_index = self._defects.copy()

    @property
    def defects(self) -> list[str]:
        """What is wrong with the bag, in one line each; complete when all has been read."""
        return [
            text if count == 1 else f'{text} ({count} times)'
            for text, count in self._defects.items()
        ]

    def note(self, defect: str) -> None:
        """Note what is wrong; of very many different defects, only their number."""
        known = defect in self._defects or len(self._defects) < _MOST_DEFECTS
        self._defects[defect if known else 'other defects'] += 1

    def _find_parts(self) -> list[Path]:
        path = self.path
        if not path.exists():
            raise ValueError(f'{path} does not exist; give the folder of a bag')
        if path.is_file() and path.suffix not in _STORAGES:
            raise ValueError(
                f'{path} is no bag; give a folder of rosbag2, or an .mcap or .db3 file'
            )
        if path.is_file():
            return [path]
        files = _files(path)
        if (path / _METADATA).exists():
            compressed = 'compression_mode: message' in (path / _METADATA).read_text().lower()
            return [path] if compressed or not files else files
        if not files:
            raise ValueError(
                f'{path} is no bag: it has no {_METADATA} and no .mcap or .db3 file; give the '
                'folder of a bag'
            )
        self.note(f'{_METADATA} is missing, the recorder was killed; its files are read')
        return files

    def _readable(self, part: Path) -> list[Path]:
        """Take topics and counts of a part; return it, or what of it can be read."""
        try:
            if part.suffix == '.db3' and part.is_file():
                self._take_topics(part)
                return [part]
            with Reader(part) as reader:
                for each in reader.connections:
                    self.topics[each.topic] = each.msgtype
                    self.count[each.topic] += each.msgcount
        except Exception as error:  # the libraries raise many for damaged files
            if part.is_dir():  # its index is damaged, or one of its files
                self.note(f'{part.name}: {_reason(error)}')
                return [file for each in _files(part) for file in self._readable(each)]
            if part.suffix == '.mcap' and self._scan_topics(part):
                self.count.clear()
                return [part]
            self.note(f'{part.name}: {_reason(error)}')
            return []
        return [part]

    def _take_topics(self, part: Path) -> None:
        """Take topics and, of a complete file, counts of an SQLite file; raises sqlite3.Error."""
        topics = read_topics(part)
        self.topics.update({topic.name: topic.type for topic in topics.values()})
        if left := unfinished(part):
            self.note(left)
        try:
            for number, count in count_messages(part).items():
                self.count[topics[number].name] += count
        except (sqlite3.Error, KeyError):  # KeyError: a topic is missing
            self.count.clear()

    def _scan_topics(self, part: Path) -> bool:
        """Take the topics of a file without index, from its first messages."""
        try:
            for number, message in enumerate(_stream(part)):
                self.topics[message.topic] = message.type
                if number > 1000:
                    break
        except Exception:
            pass
        return bool(self.topics)

    def messages(self) -> Iterator[Message]:
        """
        Yield all messages in the order of their reception; what cannot be read is left out.

        Read again, they have the defects of the last time only.
        """
        self._defects = self._defects_of_index.copy()
        for part in self._parts:
            last = None
            try:
                for last in self._part(part):
                    yield last
            except Exception as error:
                until = f'after the message at {last.received} ns' if last else 'at once'
                self.note(f'{part.name} ends {until}: {_reason(error)}')

    @staticmethod
    def _part(part: Path) -> Iterator[Message]:
        if part.suffix == '.mcap':
            # In the order of the file.  An index, which is not needed, may be missing, and rosbags
            # reads no file without one whose messages are not sorted by time.
            yield from _stream(part)
            return
        if part.is_file():
            topics = read_topics(part)
            for number, received, data in read_messages(part):
                yield Message(*topics[number], received, data)
            return
        with Reader(part) as reader:
            for connection, received, data in reader.messages():
                yield Message(connection.topic, connection.msgtype, received, data)


def _stream(part: Path) -> Iterator[Message]:
    """Yield the messages of an MCAP file from its begin, without its index."""
    with part.open('rb') as file:
        reader = NonSeekingReader(file)
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            name = schema.name if schema else ''
            yield Message(channel.topic, name, message.log_time, message.data)


def deserialise(message: Message) -> Any:
    """Return a message as an object; raises ValueError if its bytes are not one."""
    try:
        return TYPESTORE.deserialize_cdr(message.data, message.type)
    except Exception as error:
        raise ValueError(f'a message on {message.topic} is damaged: {_reason(error)}') from None
