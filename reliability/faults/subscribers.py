"""Faults of those who listen to a running node, beside others who must not notice."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from visualization_msgs.msg import MarkerArray

from ..arrivals import THROTTLE, Ticks, total
from ..live import SOON, Live, live
from ..peers import DEPTH, PEER
from ..record import Row

# Its markers are larger than what Fast DDS has room for by default.
_SCENE = ('-p', 'sheet.rows:=64', '-p', 'sheet.columns:=64')
_MARKERS = 0.1  # s, three times the period of the markers
# How often a subscriber hangs or is killed, and s in which it does.
_TIMES, _WHILE = 10, 2.5
# Who stops at the wrong moment, most likely while it holds a lock of shared memory, holds up
# whoever sends to it until Fast DDS gives it up: how often that may be seen, and s that it may
# last.
_HELD_UP, _LONGEST = 2, 5.0


class _Viewer:
    """Subscribes to markers, as RViz does, and notes when they come."""

    def __init__(self, running: Live) -> None:
        self._times: list[float] = []
        running.listener.create_subscription(
            MarkerArray, '/cloth/markers', self._note, DEPTH, raw=True
        )
        running.listener.spin_until(lambda: self._times, SOON)

    def _note(self, _: bytes) -> None:
        self._times.append(time.monotonic())

    def longest_pause(self, since: float, until: float) -> float:
        """Return the longest time without markers, s."""
        times = [each for each in self._times if since <= each <= until]
        return float(np.diff([since, *times, until]).max())


@contextmanager
def _watched() -> Iterator[tuple[Live, _Viewer]]:
    with live(*_SCENE) as running:
        yield running, _Viewer(running)


def _gone(running: Live, viewer: _Viewer, number: int) -> tuple[Ticks, float]:
    """Send a subscriber a signal; return how ticks went then, and the markers' longest pause."""
    peer = running.beside(*PEER, 'subscribe')
    try:
        peer.wait_for_output('subscribed')
        running.recover(time.monotonic())
        began = time.monotonic()
        peer.process.send_signal(number)
        running.listener.spin_for(_WHILE)
        running.recover(time.monotonic(), SOON)
        ended = time.monotonic()
        return running.ticks(began, ended), viewer.longest_pause(began, ended)
    finally:
        peer.stop(signal.SIGKILL)


def _subscriber(quick: bool, number: int, what: str) -> Row:
    times = 1 if quick else _TIMES
    with _watched() as (running, viewer):
        before = running.node.memory
        found = [_gone(running, viewer, number) for _ in range(times)]
        memory = running.node.memory - before
        well = running.well()
    noticed = sum(pause >= _MARKERS or not ticks.as_before for ticks, pause in found)
    ticks = total([ticks for ticks, _ in found])
    pause = max(pause for _, pause in found)
    held_up = f'; {noticed} times all were held up' if noticed else ''
    return Row(
        what,
        'others are served as before: no message of particles is lost, at most '
        f'{100 * THROTTLE:g} % of the ticks are late or missing, and markers of 64 × 64 particles '
        f'never pause for {_MARKERS:g} s; but all may be held up for {_LONGEST:g} s by one that '
        'stops while it holds a lock',
        f'{times} times: {ticks.text}; the longest pause of the markers {pause:.3f} s'
        f'{held_up}; memory {memory:+.1f} MB',
        well
        and max(ticks.longest, pause) < _LONGEST
        and not ticks.lost
        and (quick or noticed <= _HELD_UP),
    )


def hung_subscriber(quick: bool) -> Row:
    """A reliable subscriber that is stopped, and so acknowledges nothing."""
    return _subscriber(quick, signal.SIGSTOP, 'a reliable subscriber that hangs')


def killed_subscriber(quick: bool) -> Row:
    """A reliable subscriber that is killed, and so never says that it is gone."""
    return _subscriber(quick, signal.SIGKILL, 'a reliable subscriber that is killed')


def crowd(quick: bool) -> Row:
    """Participants that come and go, the last ten killed."""
    count = 12 if quick else 100
    with _watched() as (running, viewer):
        before, began = running.node.memory, time.monotonic()
        peer = running.beside(*PEER, 'crowd', str(count))
        try:
            running.listener.spin_until(lambda: not peer.alive)
            ended = time.monotonic()
            again = running.recover(ended, SOON)
            ticks, memory = running.ticks(began, ended), running.node.memory - before
            pause = viewer.longest_pause(began, ended)
            all_here = 'all were here' in peer.output
        finally:
            peer.stop(signal.SIGKILL)
        well = running.well()
    # Before it first writes to a participant, Fast DDS looks at whether that one is alive, and may
    # hold up whoever publishes for a third of the other's healthy_check_timeout_ms, 1 s.
    return Row(
        f'{count} subscribers that come and go',
        'each hears the node; of what others hear no message of particles is lost',
        f'{ticks.text} in {ended - began:.0f} s; the longest pause of the markers {pause:.3f} s; '
        f'at full rate again after {again:.2f} s; memory {memory:+.1f} MB',
        all_here and well and (quick or ticks.all_arrived),
    )
