"""
A subscriber that hangs while it holds a lock in shared memory, which makes its senders wait.

Fast DDS gives up after one second or more, and all that time sends nothing, also to others.
"""

import os
import signal

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
# s, less than Fast DDS waits for a lock.
BLOCKED = 0.8
HANG = 2.5  # s


@pytest.fixture
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


def longest_pause(node, seconds: float) -> float:
    """Return the longest time between two ticks from now on, s."""
    begin = len(node.ticks) - 1
    node.listener.spin_for(seconds)
    # Records of ticks may come late: messages are.
    end = node.ticks[begin] + seconds
    node.listener.spin_until(lambda: node.ticks[-1] > end)
    return float(np.diff(node.ticks[begin:]).max())


def test_a_hang_with_a_lock_held(node, long, measured):
    """
    Once, or 200 times: the cloth makes no longer pause than without.

    The subscriber is stopped again and again until it is stopped while it holds a lock.  Its
    messages, and those for others, wait for Fast DDS; ticks do not.
    """
    count, pauses, calm, tries = (200 if long else 1), [], [], 0
    with node.beside(*PEER, 'subscribe', until='begin') as peer:
        pid = peer.process.pid
        for _ in range(count):
            node.recover()
            calm.append(longest_pause(node, HANG))
            needed = stop_holding_a_lock(pid, node.listener.spin_for)
            tries += needed
            try:
                pauses.append(longest_pause(node, HANG))
            finally:
                os.kill(pid, signal.SIGCONT)
    measured(
        f'{count} times, in {tries} tries; longest pause {max(pauses):.3f} s, {max(calm):.3f} s '
        'without a hang'
    )
    node.check()
    assert max(pauses) < BLOCKED
    assert not long or max(pauses) < max(0.05, 2 * max(calm))
