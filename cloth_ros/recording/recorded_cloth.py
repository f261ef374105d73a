"""What a bag says of one cloth: records of ticks, keyframes, published states, estimates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..live.keyframe import Keyframe, decode_keyframe
from ..live.tick_record import TickRecord, decode_record
from .bag import Bag, Message, deserialise

TYPES = {
    'ticks': 'std_msgs/msg/String',
    'keyframes': 'std_msgs/msg/UInt8MultiArray',
    'particles': 'sensor_msgs/msg/PointCloud2',
    'scene': 'std_msgs/msg/String',
}
_DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'
# Bytes of a particle: x y z vx vy vz, or x y z alone, in single precision.
_POINT_STEPS = (24, 12)


class Particles(NamedTuple):
    """
    A published state.

    Attributes
    ----------
    stamp
        Its time, ns.
    values
        x y z vx vy vz of every particle, m and m/s, float32, shape (rows, columns, 6); without
        velocities, if they are not published, (rows, columns, 3).

    """

    stamp: int
    values: NDArray[np.float32]


class LiveEstimate(NamedTuple):
    """
    Error estimate that the node published: the error that was added in a window.

    Attributes
    ----------
    largest
        Of any particle, m.
    seconds, time
        Length of the window, and simulated time at its end, s.
    tick
        Number of the last tick whose record was received before it.

    """

    largest: float
    seconds: float
    time: float
    tick: int = 0


Event = TickRecord | Keyframe | Particles | LiveEstimate | Message


class RecordedCloth:
    """
    One cloth of a bag.

    Parameters
    ----------
    bag
        The bag.
    node
        Full name of the node, such as `/cloth`; None: the only one that there is.

    Attributes
    ----------
    node
        Full name of the node.
    ticks
        Number of records; 0 if the bag has no index.
    has_particles
        True if states were recorded.
    received
        When the last message that was read was received, ns.

    Raises
    ------
    ValueError
        The bag lacks what a replay needs, or has several cloths.

    """

    def __init__(self, bag: Bag, node: str | None = None) -> None:
        self._bag = bag
        self.node = choose_cloth(bag, node)
        for name in ('ticks', 'keyframes'):
            if bag.topics.get(self.topic(name)) != TYPES[name]:
                raise ValueError(
                    f'{bag.path} has no {self.topic(name)}, so {self.node} cannot be repeated; '
                    f'record {" ".join(self.topic(each) for each in TYPES)} as well'
                )
        self.has_particles = bag.topics.get(self.topic('particles')) == TYPES['particles']
        self.received = 0
        self.ticks = bag.count.get(self.topic('ticks'), 0)

    def topic(self, name: str) -> str:
        """Return the full name of a topic of the node."""
        return f'{self.node}/{name}'

    def events(self) -> Iterator[Event]:
        """Yield what the bag says, in the order of reception; other messages as they are."""
        readers: dict[str, Callable[[Message], Event]] = {
            self.topic('ticks'): _record,
            self.topic('keyframes'): _keyframe,
        }
        if self.has_particles:
            readers[self.topic('particles')] = read_particles
        for message in self._bag.messages():
            self.received = message.received
            read = readers.get(message.topic)
            try:
                if read is not None:
                    yield read(message)
                elif message.type == _DIAGNOSTICS:
                    yield from self._estimates(message)
                elif not message.topic.startswith(f'{self.node}/'):
                    yield message
            except ValueError as error:
                self._bag.note(str(error))

    def _estimates(self, message: Message) -> Iterator[LiveEstimate]:
        for status in deserialise(message).status:
            if status.name != f'{self.node}: simulation':
                continue
            values = {item.key: item.value for item in status.values}
            try:
                age, now = values['error estimate, age [s]'], values['simulated time [s]']
                yield LiveEstimate(
                    float(values['error estimate [m]']),
                    float(values['error estimate, window [s]']),
                    float(now) - float(age),
                )
            except (KeyError, ValueError):  # there was none yet
                continue


def choose_cloth(bag: Bag, node: str | None) -> str:
    """
    Return the full name of the node of a recorded cloth.

    Parameters
    ----------
    bag
        The bag.
    node
        The name to use; None: the only one that there is.

    Raises
    ------
    ValueError
        There is no such cloth, none at all, or several to choose from.

    """
    nodes = sorted(
        topic.removesuffix('/particles')
        for topic, kind in bag.topics.items()
        if topic.endswith('/particles') and kind == TYPES['particles']
    )
    others = {
        topic.removesuffix('/ticks')
        for topic, kind in bag.topics.items()
        if topic.endswith('/ticks') and kind == TYPES['ticks']
    }
    nodes = sorted({*nodes, *others})
    if node is not None and node not in nodes:
        known = ', '.join(nodes) or 'none'
        raise ValueError(f'{bag.path} has no cloth {node}; --cloth can be: {known}')
    if node is not None:
        return node
    if not nodes:
        topics = ', '.join(sorted(bag.topics)) or 'none'
        raise ValueError(f'{bag.path} is no recording of a cloth; it has the topics: {topics}')
    if len(nodes) > 1:
        raise ValueError(
            f'{bag.path} has several cloths: {", ".join(nodes)}; add --cloth {nodes[0]}'
        )
    return nodes[0]


def _record(message: Message) -> TickRecord:
    try:
        record = decode_record(deserialise(message).data)
        _ = record.inputs, [change.scene for change in record.changes]  # checked here
    except ValueError as error:
        raise ValueError(f'a record on {message.topic} is damaged: {error}') from None
    return record


def _keyframe(message: Message) -> Keyframe:
    try:
        keyframe = decode_keyframe(bytes(deserialise(message).data))
        _ = keyframe.scene, keyframe.snapshot  # checked here
    except ValueError as error:
        raise ValueError(f'a keyframe on {message.topic} is damaged: {error}') from None
    return keyframe


def read_particles(message: Message) -> Particles:
    """Return a published state; raises ValueError if the message is not one of a cloth."""
    cloud: Any = deserialise(message)
    shape = (cloud.height, cloud.width, cloud.point_step // 4)
    if cloud.point_step not in _POINT_STEPS or len(cloud.data) != 4 * np.prod(shape):
        raise ValueError(f'a message on {message.topic} has other fields than x y z vx vy vz')
    stamp = cloud.header.stamp.sec * 10**9 + cloud.header.stamp.nanosec
    return Particles(stamp, np.frombuffer(cloud.data, np.float32).reshape(shape))
