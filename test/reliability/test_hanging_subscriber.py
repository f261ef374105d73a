"""
A subscriber that is stopped or killed while it holds a lock in shared memory.

Left alone, Fast DDS waits for it: a second for each part of a message, until it gives it up.
"""

import os
import signal
import time

import numpy as np
import pytest
from reliability.held_locks import stop_holding_a_lock
from reliability.live_node import live_node
from reliability.peers import PEER
from std_msgs.msg import String

from cloth_ros.live.tick_record import decode_record

pytestmark = pytest.mark.slow

# Large messages: their parts are many, and a lock is taken and released for each.
LARGE = ('-p', 'sheet.rows:=64', '-p', 'sheet.columns:=64')
WAIT = 1.0  # s, which Fast DDS waits for a lock
LONGEST = {'ticks': 0.05, 'particles': 0.1}  # s


@pytest.fixture(scope='module')
def node(long):
    with live_node(*LARGE, timed=long) as node:
        node.ticks = []
        node.listener.create_subscription(
            String,
            '/cloth/ticks',
            lambda message: node.ticks.append(1e-9 * decode_record(message.data).clock),
            1000,
        )
        node.listener.spin_until(lambda: node.ticks)
        yield node


def longest_pauses(node, seconds: float) -> dict[str, float]:
    """Return the longest times from now on between ticks and between particles received, s."""
    begin, since = len(node.ticks) - 1, time.monotonic()
    node.listener.spin_for(seconds)
    arrived = [each.at for each in node.listener.particles if each.at >= since]
    particles = np.diff([since, *arrived, time.monotonic()]).max()
    # Records of ticks may come late, as all messages.
    end = node.ticks[begin] + seconds
    node.listener.spin_until(lambda: node.ticks[-1] > end)
    return {'ticks': float(np.diff(node.ticks[begin:]).max()), 'particles': float(particles)}


@pytest.mark.parametrize(
    ('fault', 'times'), [('hangs', 200), ('is killed', 20)], ids=['hangs', 'is killed']
)
def test_with_a_lock_held(node, fault, times, long, measured):
    """
    The cloth pauses for 0.05 s at most and others for 0.1 s, or not longer than without.

    The subscriber is stopped again and again until it holds a lock, and then left so or killed.
    """
    pauses, calm, tries, released = [], [], 0, node.process.output.count('was released')
    for _ in range(times if long else 1):
        with node.beside(*PEER, 'subscribe', until='begin') as peer:
            node.recover()
            calm.append(longest_pauses(node, 2 * WAIT))
            tries += stop_holding_a_lock(peer.process.pid, node.listener.spin_for)
            if fault == 'is killed':
                peer.stop(signal.SIGKILL)
            pauses.append(longest_pauses(node, 2 * WAIT))
            if fault == 'hangs':
                os.kill(peer.process.pid, signal.SIGCONT)
                node.recover()
    released = node.process.output.count('was released') - released
    longest = {name: max(each[name] for each in pauses) for name in LONGEST}
    without = {name: max(each[name] for each in calm) for name in LONGEST}
    measured(
        f'{len(pauses)} times in {tries} tries; longest pause of ticks {longest["ticks"]:.3f} s, '
        f'of particles received {longest["particles"]:.3f} s; without a hang '
        f'{without["ticks"]:.3f} and {without["particles"]:.3f} s'
    )
    node.check()
    assert released
    for name, most in LONGEST.items():
        # A busy machine makes pauses as well.
        assert longest[name] < (max(most, 2 * without[name]) if long else 0.8 * WAIT)
