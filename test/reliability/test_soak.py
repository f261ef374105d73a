"""A live node for a long time: its memory, rate and warnings."""

import math
import signal
import time

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from reliability.live_node import live_node
from reliability.peers import PEER
from ros import pose, wind
from visualization_msgs.msg import MarkerArray

# A curtain in gusts; wind and a sphere that swings through its lower edge are commanded.
SCENE = ('--params-file', 'config/gust.yaml')
SIZE = ('-p', 'sheet.rows:=64', '-p', 'sheet.columns:=64')
COMMANDS, SWING, BREEZE = 50.0, 8.0, 3.0  # Hz, and s, periods of sphere and wind
WARM_UP = 300.0  # s: caches fill, the error estimate finds its window
ESTIMATE = 'error estimate, window [s]'


def command(node, seconds: float) -> np.ndarray:
    """Command wind and sphere for some time; return the memory of the node each second, MB."""
    listener, memory = node.listener, []
    breeze = listener.publisher(Vector3Stamped, '/wind')
    sphere = listener.publisher(PoseStamped, '/sphere_pose')
    start = time.monotonic()
    for n in range(round(COMMANDS * seconds)):
        now = n / COMMANDS
        listener.spin_for(max(start + now - time.monotonic(), 0.001))
        breeze.publish(wind(y=2.0 * math.sin(2 * math.pi * now / BREEZE)))
        sphere.publish(pose(y=-0.6 * math.cos(2 * math.pi * now / SWING), z=1.0))
        if n % COMMANDS == 0:
            memory.append(node.process.memory)
            if n % (60 * COMMANDS) == 0:
                print(f'{now:.0f} s: {memory[-1]:.2f} MB', flush=True)
    return np.array(memory)


def fill_queues(node) -> None:
    """
    Stop a subscriber for a while, so that the queues of DDS are full once.

    They keep their memory for the next messages.  A busy machine fills them now and then, each
    time by some more, which would look like a leak for hours and ends with their depth.
    """
    with node.beside(*PEER, 'subscribe', until='begin') as peer:
        for number in (signal.SIGSTOP, signal.SIGCONT):
            node.listener.spin_for(2.0)
            peer.process.send_signal(number)
        node.recover()


@pytest.mark.slow
def test_soak(long, soak_seconds, measured):
    """
    A live scene, 64 × 64 in the long form: memory grows by less than 1 MB per hour after warm-up,
    60 Hz and real time are kept to 1 %, no warnings, all is finite.
    """
    arguments = (*SCENE, *(SIZE if long else ()))
    if long:
        # Memory that was used and freed to load and compile kernels would hide what is used later.
        with live_node(*arguments, timed=False) as node:
            node.listener.spin_until(lambda: ESTIMATE in node.listener.next_report().values)
    with live_node(*arguments, timed=long) as node:
        listener = node.listener
        listener.create_subscription(MarkerArray, '/cloth/markers', lambda _: None, 5, raw=True)
        if long:
            fill_queues(node)
        listener.spin_until(lambda: ESTIMATE in listener.next_report().values)
        listener.particles.clear()
        listener.reports.clear()
        printed = len(node.process.output)
        with node.interval() as interval:
            memory = command(node, soak_seconds)
        node.check()
        lines = node.process.output[printed:].splitlines()
        assert node.process.stop() == 0, node.process.output
    reports, (first, *_, last) = listener.reports, listener.particles
    rate = (last.number - first.number) / (last.sent - first.sent)
    real_time = (reports[-1].simulated - reports[0].simulated) / (reports[-1].at - reports[0].at)
    warnings = [line for line in lines if '[INFO]' not in line]
    warnings += [each.message for each in reports if each.level != DiagnosticStatus.OK]
    begin = int(min(WARM_UP, soak_seconds / 4))
    growth = memory[-1] - memory[begin]
    slope = 3600 * np.polyfit(np.arange(len(memory) - begin), memory[begin:], 1)[0]
    measured(
        f'{soak_seconds:.0f} s; memory {memory[-1]:.1f} MB, {growth:+.2f} MB in the last '
        f'{len(memory) - begin} s, {slope:+.2f} MB per hour by a linear fit; {rate:.4f} Hz, '
        f'real-time factor {real_time:.5f}; {interval.text}; {len(warnings)} warnings'
    )
    assert growth < 8.0  # less than all messages of some seconds
    assert not [each for each in warnings if 'slow motion' not in each]
    if long:
        assert warnings == []
        assert abs(rate / 60 - 1) < 0.01
        assert abs(real_time - 1) < 0.01
        assert slope < 1.0 if soak_seconds > 1000 else growth < 3.0
