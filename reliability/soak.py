"""
A live node for hours: its memory, its rate, its warnings.

    python -m reliability.soak [--seconds 3600]

A curtain of 64 × 64 particles in gusts, with wind and sphere commanded from this process, which
also subscribes to particles, markers and diagnostics.  The sphere swings through the lower edge of
the curtain.  Once a second what the node takes is noted; at the end it is said how that changed.
Before that, kernels are compiled and queues are full once.  Less than an hour is not written to
docs/reliability.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from dataclasses import dataclass, field

import numpy as np
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from visualization_msgs.msg import MarkerArray

from .arrivals import OK, lost
from .live import Live, live
from .peers import PEER
from .record import Row, broken, write

_SCENE = ('--params-file', 'config/gust.yaml', '-p', 'sheet.rows:=64', '-p', 'sheet.columns:=64')
_COMMANDS = 50.0  # Hz
_SWING, _BREEZE = 8.0, 3.0  # s, periods of sphere and wind
_WARM_UP = 300.0  # s, or a quarter of the whole: caches fill, the error monitor finds its window
_PROGRESS = 60  # s
_SECONDS = 3600.0  # of a full run
_HANGING = 2.0  # s
_ESTIMATE = 'error estimate, over the last [s]'

# What is promised.
GROWTH = 1.0  # MB an hour
DRIFT = 0.01  # of rate and of real time


@dataclass
class Soak:
    """
    What was measured.

    Attributes
    ----------
    seconds, memory
        When it was noted, s, and the node's own resident memory then, MB.
    rate, longest
        Of the ticks, Hz, over the whole, and the longest time between two that arrived, s; counted
        and timed by the publisher.
    factors
        Real-time factor of each report.
    real_time
        Simulated by wall-clock time, over the whole.
    lost, not_finite
        Messages of particles that did not arrive, and those with a number in them that is none.
    warnings
        Lines of the log and reports that are not well, from the first command on.

    """

    seconds: list[float] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)
    rate: float = 0.0
    longest: float = 0.0
    factors: list[float] = field(default_factory=list)
    real_time: float = 0.0
    lost: int = 0
    not_finite: int = 0
    warnings: list[str] = field(default_factory=list)

    def growth(self, warm_up: float) -> tuple[float, float]:
        """Return what memory grew by after the warm-up, MB, and its slope in MB an hour."""
        seconds, memory = np.array(self.seconds), np.array(self.memory)
        after = seconds >= warm_up
        slope, _ = np.polyfit(seconds[after], memory[after], 1)
        return float(memory[after][-1] - memory[after][0]), 3600 * float(slope)


def _fill_queues(running: Live) -> None:
    """
    Have a subscriber hang for a while, so that the queues of DDS are full once.

    What they hold is kept for the next messages.  A busy machine fills them now and then, each
    time by some more, which would look like a leak for hours, and ends with their depth.
    """
    peer = running.beside(*PEER, 'subscribe')
    try:
        peer.wait_for_output('subscribed')
        running.listener.spin_for(_HANGING)
        peer.process.send_signal(signal.SIGSTOP)
        running.listener.spin_for(_HANGING)
        peer.process.send_signal(signal.SIGCONT)
    finally:
        peer.end()
    running.recover(time.monotonic())


def _command(running: Live, seconds: float, soak: Soak) -> None:
    """Move wind and sphere for some time, and note once a second what the node takes."""
    listener = running.listener
    wind = listener.publisher(Vector3Stamped, '/wind')
    sphere = listener.publisher(PoseStamped, '/sphere_pose')
    breeze, place = Vector3Stamped(), PoseStamped()
    start, sent = time.monotonic(), 0
    while (now := time.monotonic() - start) < seconds:
        if now >= sent / _COMMANDS:
            breeze.vector.y = 2.0 * math.sin(2 * math.pi * now / _BREEZE)
            place.pose.position.y = -0.6 * math.cos(2 * math.pi * now / _SWING)
            place.pose.position.z = 1.0
            wind.publish(breeze)
            sphere.publish(place)
            sent += 1
        if now >= len(soak.seconds):
            soak.seconds.append(now)
            soak.memory.append(running.node.memory)
            if len(soak.seconds) % _PROGRESS == 0:
                print(f'{now:.0f} s: {soak.memory[-1]:.2f} MB, {_newest(running)}', flush=True)
        listener.spin_for(max(min(sent / _COMMANDS - (time.monotonic() - start), 0.02), 0.0))


def _newest(running: Live) -> str:
    report = running.listener.reports[-1]
    return f'{report.message}, load {report.values["load [share of real time]"]}'


def run(seconds: float, *ros_arguments: str) -> Soak:
    """Run a node for some time; more ROS arguments may change its scene."""
    soak = Soak()
    # What compiling kernels has taken and freed would hide what is taken later; the last of them
    # are those of the error estimate.
    with live(*_SCENE, *ros_arguments) as running:
        reports = running.listener.reports
        running.listener.spin_until(lambda: _ESTIMATE in reports[-1].values)
    with live(*_SCENE, *ros_arguments) as running:
        listener = running.listener
        listener.create_subscription(MarkerArray, '/cloth/markers', lambda _: None, 5, raw=True)
        _fill_queues(running)
        listener.particles.clear()
        listener.reports.clear()
        printed = len(running.node.output)
        _command(running, seconds, soak)
        first, last = listener.particles[0], listener.particles[-1]
        reports = listener.reports
        soak.rate = (last.number - first.number) / (last.sent - first.sent)
        soak.longest = float(np.diff([each.sent for each in listener.particles]).max())
        soak.lost = lost(listener.particles)
        soak.not_finite = listener.not_finite
        soak.factors = [each.factor for each in reports]
        simulated = reports[-1].simulated - reports[0].simulated
        soak.real_time = simulated / (reports[-1].at - reports[0].at)
        soak.warnings = [
            line for line in running.node.output[printed:].splitlines() if '[INFO]' not in line
        ]
        soak.warnings += [each.message for each in reports if each.level != OK]
        assert running.node.stop() == 0, running.node.output
    return soak


def rows(soak: Soak, seconds: float) -> list[Row]:
    """Return what was promised and measured."""
    warm_up = min(_WARM_UP, seconds / 4)
    growth, slope = soak.growth(warm_up)
    quarters = [float(np.mean(each)) for each in np.array_split(soak.factors, 4)]
    return [
        Row(
            'memory of the node, pages of files left out',
            f'grows by less than {GROWTH:g} MB an hour after warm-up',
            f'{slope:+.2f} MB an hour by a linear fit after {warm_up:.0f} s; {growth:+.2f} MB in '
            f'the {seconds - warm_up:.0f} s, to {soak.memory[-1]:.1f} MB',
            slope < GROWTH,
        ),
        Row(
            'rate of the ticks',
            f'60 Hz, kept to {100 * DRIFT:g} %',
            f'{soak.rate:.4f} Hz, at most {soak.longest:.3f} s between two; {soak.lost} messages '
            'lost',
            abs(soak.rate / 60 - 1) < DRIFT,
        ),
        Row(
            'real-time factor',
            f'1, kept to {100 * DRIFT:g} %',
            f'{soak.real_time:.5f} over the whole; least in a second {min(soak.factors):.3f}; '
            f'means of the four quarters {", ".join(f"{each:.4f}" for each in quarters)}',
            abs(soak.real_time - 1) < DRIFT,
        ),
        Row(
            'warnings, in the log and in /diagnostics, once the node has started',
            'none',
            f'{len(soak.warnings)}' + ''.join(f'; {each}' for each in soak.warnings[:3]),
            not soak.warnings,
        ),
        Row('numbers that are not finite', 'none', f'{soak.not_finite}', not soak.not_finite),
    ]


def main() -> int:
    """Run, print and write; return 1 if a promise was broken."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=_SECONDS)
    seconds = parser.parse_args().seconds
    what = f'a live 64 × 64 scene for {seconds:g} s'
    try:
        found = rows(run(seconds), seconds)
        summary = f'{what}: memory {found[0].measured}'
    except Exception as error:
        found, summary = [broken(what, 'that the node is well to the end', error)], what
    title = what.capitalize()
    full = seconds >= _SECONDS
    return 0 if write('soak', 'make soak', title, summary, found, full=full) else 1


if __name__ == '__main__':
    sys.exit(main())
