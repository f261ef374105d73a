"""Faults of what sits beside a running node, and of its process; on one node, in a row."""

from __future__ import annotations

import os
import signal
import time

from rcl_interfaces.srv import SetParameters
from rclpy.qos import qos_profile_parameters
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

from ..live import NODE, Live, to_set
from ..peers import LAST, PEER
from ..record import Row

_SOON = 30.0  # s, within which the node must be well again
_WELL = 'full rate and real time again'


def stopped(running: Live, quick: bool) -> Row:
    """SIGSTOP and SIGCONT."""
    seconds = 1.5 if quick else 10.0
    began, last = time.monotonic(), running.listener.reports[-1]
    os.kill(running.node.process.pid, signal.SIGSTOP)
    running.listener.spin_for(seconds)
    os.kill(running.node.process.pid, signal.SIGCONT)
    recovery = running.recover(time.monotonic(), _SOON)
    now = running.listener.reports[-1]
    simulated = now.simulated - last.simulated
    made_up = simulated - (now.at - last.at - seconds)
    return Row(
        f'the node stopped for {seconds:g} s and continued',
        f'{_WELL}; no more than solver.max_tick, 0.1 s, is made up',
        f'{running.ticks(began - 1.0, time.monotonic())}; recovered in {recovery:.2f} s; '
        f'{max(made_up, 0.0):.2f} s made up',
        running.well() and made_up < 0.2,  # and two reports are no more exact than some ticks
    )


def _subscriber(running: Live, quick: bool, number: int, what: str) -> Row:
    seconds = 1.0 if quick else 10.0
    peer = running.beside(*PEER, 'subscribe')
    try:
        peer.wait_for_output('subscribed')
        before = running.node.memory
        running.recover(time.monotonic())
        began = time.monotonic()
        peer.process.send_signal(number)
        running.listener.spin_for(seconds)
        ended = time.monotonic()
        recovery = running.recover(began, _SOON)
        measured = (
            f'{running.ticks(began, ended)}; recovered in {recovery:.2f} s; memory '
            f'{running.node.memory - before:+.1f} MB'
        )
    finally:
        peer.stop(signal.SIGKILL)
    return Row(what, 'others are served as before', measured, running.well())


def hung_subscriber(running: Live, quick: bool) -> Row:
    """A reliable subscriber that is stopped, and so acknowledges nothing."""
    return _subscriber(running, quick, signal.SIGSTOP, 'a reliable subscriber that hangs')


def killed_subscriber(running: Live, quick: bool) -> Row:
    """A reliable subscriber that is killed, and so never says that it is gone."""
    return _subscriber(running, quick, signal.SIGKILL, 'a reliable subscriber that is killed')


def crowd(running: Live, quick: bool) -> Row:
    """Participants that come and go, the last ten killed."""
    count = 12 if quick else 100
    before, began = running.node.memory, time.monotonic()
    peer = running.beside(*PEER, 'crowd', str(count))
    try:
        running.listener.spin_until(lambda: not peer.alive)
        ended = time.monotonic()
        recovery = running.recover(ended, _SOON)
        measured = (
            f'{running.ticks(began, ended)} in {ended - began:.0f} s; recovered in '
            f'{recovery:.2f} s; memory {running.node.memory - before:+.1f} MB'
        )
        all_here = 'all were here' in peer.output
    finally:
        peer.stop(signal.SIGKILL)
    return Row(
        f'{count} subscribers that come and go',
        'each hears the node; others are served as before',
        measured,
        all_here and running.well(),
    )


def flood(running: Live, quick: bool) -> Row:
    """Wind and sphere far more often than there are ticks."""
    rate, seconds = 2000, 2 if quick else 10
    markers = running.listener.collect(MarkerArray, '/cloth/markers', depth=1)
    running.listener.spin_until(lambda: markers, _SOON)
    peer = running.beside(*PEER, 'flood', str(rate), str(seconds))
    try:
        before, used, began = running.node.memory, running.node.cpu_seconds, time.monotonic()
        running.listener.spin_until(lambda: not peer.alive)
        ended = time.monotonic()
        used = running.node.cpu_seconds - used
        recovery = running.recover(ended, _SOON)

        def obeyed() -> bool:
            newest = {marker.ns: marker for marker in markers[-1].markers}
            still = newest['wind'].action == Marker.DELETE
            return still and newest['sphere'].pose.position.z == LAST

        running.listener.spin_until(obeyed, _SOON)
        measured = (
            f'{peer.output.strip()} were sent; {running.ticks(began, ended)}; recovered in '
            f'{recovery:.2f} s; {100 * used / (ended - began):.0f} % of a core; memory '
            f'{running.node.memory - before:+.1f} MB'
        )
    finally:
        peer.stop(signal.SIGKILL)
    return Row(
        f'wind and sphere at {rate} Hz each',
        'real time is kept, and the last command of each is obeyed',
        measured,
        running.well(),
    )


def _another_scene(number: int) -> dict[str, object]:
    """Return a change that comes after others; with air or without takes other kernels."""
    changes: tuple[dict[str, object], ...] = (
        {'springs.bending': 50.0 + number % 7},
        {'wind.air_density': 1.2 * (number % 2)},
        {'drag': 0.5 + 0.1 * (number % 5)},
    )
    return changes[number % len(changes)]


def parameters(running: Live, quick: bool) -> Row:
    """Parameters 100 times a second, with resets and pauses among them."""
    rate, seconds = 100.0, 2.0 if quick else 10.0
    listener = running.listener
    # As deep as the service: answers that we do not take in time must not displace one another.
    change = listener.create_client(
        SetParameters, '/cloth/set_parameters', qos_profile=qos_profile_parameters
    )
    pause = listener.client(SetBool, '/cloth/pause')
    reset = listener.client(Trigger, '/cloth/reset')
    listener.set_parameters_of_cloth({'springs.bending': 50.0})
    listener.call(Trigger, '/cloth/reset', Trigger.Request())
    listener.spin_until(change.service_is_ready)
    before, used, began = running.node.memory, running.node.cpu_seconds, time.monotonic()
    answers = []
    while (now := time.monotonic() - began) < seconds:
        if len(answers) >= rate * now:
            listener.spin_for(2e-3)
        elif len(answers) % 20 == 10:
            answers.append(reset.call_async(Trigger.Request()))
        elif len(answers) % 20 in (0, 5):
            hold = len(answers) % 20 == 0
            answers.append(pause.call_async(SetBool.Request(data=hold)))
        else:
            answers.append(change.call_async(to_set(_another_scene(len(answers)))))
    ended = time.monotonic()
    used = running.node.cpu_seconds - used
    listener.spin_until(lambda: all(answer.done() for answer in answers), _SOON)
    answered = time.monotonic() - ended
    listener.destroy_client(change)
    listener.set_parameters_of_cloth({'wind.air_density': 1.2, 'drag': 0.5})
    kept = running.well()
    recovery = running.recover(ended, _SOON)
    return Row(
        f'parameters changed {rate:g} times a second, resets and pauses among them',
        'every request is answered',
        f'{len(answers)} requests, the last answered {answered:.2f} s after the end; '
        f'{running.ticks(began, ended)}; recovered in {recovery:.2f} s; '
        f'{100 * used / seconds:.0f} % of a core; memory '
        f'{running.node.memory - before:+.1f} MB',
        kept,
    )


def hog(running: Live, quick: bool) -> Row:
    """As many busy processes as there are cores."""
    seconds = 2.5 if quick else 10.0
    hogs = [running.beside(*PEER, 'burn') for _ in range(os.cpu_count() or 1)]
    try:
        for each in hogs:
            each.wait_for_output('burning')
        began = time.monotonic()
        running.listener.spin_for(seconds)
        ended = time.monotonic()
        reports = [each for each in running.listener.reports if began < each.at <= ended]
    finally:
        for each in hogs:
            each.stop(signal.SIGKILL)
    recovery = running.recover(time.monotonic(), _SOON)
    slowest = min((each.factor for each in reports), default=0.0)
    return Row(
        'as many busy processes as cores',
        f'it goes on; {_WELL} afterwards',
        f'{running.ticks(began, ended)}; least real-time factor {slowest:.3f}; recovered in '
        f'{recovery:.2f} s',
        running.well(),
    )


def namesakes(running: Live, quick: bool) -> Row:
    """Another node of the same name."""
    other = running.beside(*NODE)
    try:
        for node in (running.node, other):
            node.wait_for_output('another node called /cloth')
        both = running.well() and other.alive
    finally:
        other.end()
    recovery = running.recover(time.monotonic(), _SOON)
    return Row(
        'another node of the same name, which ends again',
        'both live, and both say so',
        f'both warned, services were answered; alone again, {_WELL} in {recovery:.2f} s',
        both and running.well(),
    )
