"""Bad messages, and bad requests for parameters, sent to a live node."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock

from .live import Live
from .tally import Tally

# Of the node: what it listens to must not be lost in its queues, or the counts would not agree.
SCENE = (
    *('-p', 'sheet.rows:=8', '-p', 'sheet.columns:=8'),
    *('-p', 'sphere.radius:=0.1', '-p', 'sphere.position:=[0.0, 0.0, 3.0]'),
    *('-p', 'qos_overrides./wind.subscription.depth:=1000'),
    *('-p', 'qos_overrides./sphere_pose.subscription.depth:=1000'),
)
_CENTRE = np.array([0.0, 0.0, 1.0])  # of the sheet, m
_BATCH = 400  # messages, then the node is asked whether it has counted them
_APART = 0.003  # s, between two messages on /clock
_PATIENCE = 15.0  # s, for it to have done so
KINDS = {'wind': Vector3Stamped, 'sphere_pose': PoseStamped}
_NUMBERS = [
    *(np.nan, np.inf, -np.inf, 5e-324, -5e-324, 2.2e-308, 1e308, -1e308, 1e39, -0.0, 0.0, 1e-9),
    *(1.0, -2.0, 9.9e3, 1e4, 1.0001e4, 999.0, -1e6, 1.1e6, 2.0**53, 3.4e38),
]
_SECONDS = [0, 1, -1, -(2**31), 2**31 - 1, 1_700_000_000]
_NANOSECONDS = [0, 1, 10**9 - 1, 10**9, 2**32 - 1]
_FRAMES = [
    *(
        '',
        '',
        '',
        'world',
        'world',
        'world',
        'moon',
        'World',
        '/world',
        'world ',
        'é',
        '\U0001f9f5',
    ),
    *('\n', 'x' * 10_000),
]


def is_valid(message: Vector3Stamped | PoseStamped) -> bool:
    """Tell if the node is to heed a message, from what the README says of it."""
    if message.header.frame_id not in ('', 'world'):
        return False
    if isinstance(message, Vector3Stamped):
        place, most = message.vector, 1e4
    else:
        place, most = message.pose.position, 1e6
    numbers = np.array([place.x, place.y, place.z])
    if not np.all(np.abs(numbers) <= most):  # False for NaN
        return False
    # Spheres: within 1 km of the sheet.
    return most == 1e4 or bool(np.linalg.norm(numbers - _CENTRE) <= 1000.1)


def drawn(generator: np.random.Generator, topic: str) -> Vector3Stamped | PoseStamped:
    """Return a message that may have anything in it."""
    message = KINDS[topic]()
    message.header.frame_id = str(generator.choice(_FRAMES))
    message.header.stamp.sec = int(generator.choice(_SECONDS))
    message.header.stamp.nanosec = int(generator.choice(_NANOSECONDS))

    def fill(part: object, names: str) -> None:
        for name in names:
            tame = generator.random() < 0.5
            number = generator.normal() if tame else generator.choice(_NUMBERS)
            setattr(part, name, float(number))

    if isinstance(message, Vector3Stamped):
        fill(message.vector, 'xyz')
    else:
        fill(message.pose.position, 'xyz')
        fill(message.pose.orientation, 'xyzw')
    return message


def damaged(generator: np.random.Generator, topic: str) -> bytes:
    """Return the bytes of a message, some of them wrong or missing."""
    message = KINDS[topic]()
    message.header.frame_id = str(generator.choice(['', 'world', 'worlds']))
    text = bytearray(serialize_message(message))
    kind = generator.integers(5)
    if kind == 0:
        # By words, as DDS fills the last one up.
        del text[4 * generator.integers(len(text) // 4) :]
    elif kind == 1:
        place = int(generator.integers(len(text)))
        text[place : place + 4] = generator.bytes(4)
    elif kind == 2:  # the length of frame_id
        length = int(generator.choice([0, 1, 2, 7, 2**16, 2**31, 2**32 - 1]))
        text[12:16] = length.to_bytes(4, 'little')
    elif kind == 3:  # the encapsulation
        text[:4] = generator.bytes(4)
    else:
        text += generator.bytes(generator.integers(1, 100))
    return bytes(text)


class Sender:
    """Sends messages to a live node, and has it account for them."""

    def __init__(self, running: Live, tally: Tally, *, exactly: bool) -> None:
        self._running, self._tally, self._exactly = running, tally, exactly
        listener = running.listener
        # As deep as a batch is long: what the node has not heard yet must not be displaced.
        self._out = {
            topic: listener.publisher(kind, f'/{topic}', _BATCH) for topic, kind in KINDS.items()
        }
        self._before = self._counted()
        self._bad = Counter(self._before)
        self._sent = 0

    def send(self, topic: str, message: object, valid: bool | None) -> None:
        """Send a message that is valid, or not, or (None) will not be delivered."""
        self._out[topic].publish(message)
        self._bad[topic] += valid is False
        self._sent += 1
        if self._sent == _BATCH:
            self.account()

    def end(self) -> None:
        """Send no more."""
        for publisher in self._out.values():
            self._running.listener.destroy_publisher(publisher)

    def _counted(self) -> dict[str, int]:
        values = self._running.listener.reports[-1].values
        return {topic: int(values[f'rejected {topic}']) for topic in KINDS}

    def account(self) -> None:
        """
        Wait until the node has counted what was bad, and no more; take what it counts as refused.

        Of damaged bytes DDS may drop what it likes: there, until it has reported twice.
        """
        running, listener = self._running, self._running.listener

        counted = self._counted
        expected = {topic: self._bad[topic] for topic in KINDS}
        start = len(listener.reports)
        end = time.monotonic() + _PATIENCE
        listener.spin_until(
            lambda: (
                not running.node.alive
                or (len(listener.reports) > start and counted() == expected)
                or (len(listener.reports) > start + 1 and not self._exactly)
                or time.monotonic() > end
            )
        )
        if not running.node.alive:
            raise AssertionError(f'the node has ended: {running.node.output[-2000:]}')
        now = counted()
        too_many = any(now[topic] > expected[topic] for topic in KINDS)
        if too_many or (self._exactly and now != expected):
            self._tally.blame(f'counted {now}, not {expected}', 'a batch of messages')
        refused = sum(now.values()) - sum(self._before.values())
        self._tally.refused += refused
        self._tally.accepted += self._sent - refused
        self._before, self._sent = now, 0
        if self._exactly:  # else what comes late may count in the next batch
            self._bad = Counter(now)
        if listener.not_finite:
            self._tally.blame(f'{listener.not_finite} states not finite', 'a batch of messages')
            listener.not_finite = 0


def _topics(generator: np.random.Generator, cases: int) -> Iterator[str]:
    names = list(KINDS)
    for _ in range(cases):
        yield names[generator.integers(len(names))]


def _sent(running: Live, tally: Tally, cases: int, make: Callable, *, exactly: bool) -> Tally:
    generator = np.random.default_rng(0)
    sender = Sender(running, tally, exactly=exactly)
    for topic in _topics(generator, cases):
        sender.send(topic, *make(generator, topic))
    sender.account()
    sender.end()
    return tally


def messages(running: Live, cases: int) -> Tally:
    """Send messages with anything in them."""

    def make(generator: np.random.Generator, topic: str) -> tuple[object, bool | None]:
        message = drawn(generator, topic)
        return message, is_valid(message)

    tally = Tally(
        'messages on wind and sphere_pose', 'heeded, or refused and counted, each of them'
    )
    return _sent(running, tally, cases, make, exactly=True)


def corrupted(running: Live, cases: int) -> Tally:
    """Send bytes that may be no message."""

    def make(generator: np.random.Generator, topic: str) -> tuple[object, bool | None]:
        text = damaged(generator, topic)
        try:
            message = deserialize_message(text, KINDS[topic])
        except Exception:  # rclpy has a type of its own for it
            return text, None
        return text, is_valid(message)

    tally = Tally(
        'bytes that are no message, or a damaged one',
        'dropped by DDS, heeded, or refused and counted: some, and none too many; the node '
        'runs on',
        ('counted as refused', 'dropped or heeded'),
    )
    _sent(running, tally, cases, make, exactly=False)
    if not tally.refused:
        tally.blame('none counted', 'bytes')
    return tally


def clocks(running: Live, cases: int) -> Tally:
    """Send /clock with anything in it; the node follows it meanwhile."""
    # The node keeps only the newest: how many it has seen no one knows but itself.
    tally = Tally(
        'messages on /clock',
        'followed, displaced by a newer one, or refused and counted: some, and none too many; the '
        'node runs on',
        ('counted as refused', 'followed or displaced'),
    )
    generator, listener = np.random.default_rng(0), running.listener

    def counted() -> int:
        return int(listener.reports[-1].values['rejected clock'])

    listener.set_parameters_of_cloth({'use_sim_time': True})
    out = listener.publisher(Clock, '/clock')
    before, bad = counted(), 0
    for _ in range(cases):
        message = Clock()
        message.clock.sec = sec = int(generator.choice(_SECONDS))
        message.clock.nanosec = nanosec = int(generator.choice(_NANOSECONDS))
        out.publish(message)
        bad += sec < 0 or nanosec >= 10**9
        listener.spin_for(_APART)
    listener.set_parameters_of_cloth({'use_sim_time': False})
    listener.destroy_publisher(out)
    start = len(listener.reports)
    listener.spin_until(lambda: len(listener.reports) > start + 1)
    tally.refused = counted() - before
    tally.accepted = cases - tally.refused
    if not min(bad, 1) <= tally.refused <= bad:
        tally.blame(f'{tally.refused} counted, of {bad} bad ones', 'messages on /clock')
    if listener.not_finite:
        tally.blame(f'{listener.not_finite} states not finite', 'messages on /clock')
        listener.not_finite = 0
    return tally
