"""Faults of what commands a running node, of what is beside it and of its process, in a row."""

from __future__ import annotations

import os
import signal
import time
from collections import deque

from rcl_interfaces.srv import SetParameters
from rclpy.qos import qos_profile_parameters
from rclpy.serialization import deserialize_message
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

from ..arrivals import REAL_TIME
from ..live import NODE, SOON, Live, to_set
from ..peers import LAST, PEER
from ..record import Row

_WELL = 'full rate and real time again'
_MAX_TICK = 0.1  # s, the default of solver.max_tick
# s, by which the time between two reports may miss what was simulated between them: each says
# what the last tick before it has come to.
_INEXACT = 0.1


def stopped(running: Live, quick: bool) -> Row:
    """SIGSTOP and SIGCONT."""
    seconds = 1.5 if quick else 10.0
    first = running.next_report()
    began = time.monotonic()
    os.kill(running.node.process.pid, signal.SIGSTOP)
    running.listener.spin_for(seconds)
    os.kill(running.node.process.pid, signal.SIGCONT)
    continued = time.monotonic()
    again = running.recover(continued, SOON)
    last = running.next_report()
    ran = last.at - first.at - (continued - began)
    made_up = last.simulated - first.simulated - ran
    return Row(
        f'the node stopped for {seconds:g} s and continued',
        f'{_WELL}; no more than solver.max_tick, {_MAX_TICK:g} s, is made up, and nothing is lost '
        f'but the stop, both to {_INEXACT:g} s',
        f'{running.ticks(began - 1.0, last.at).text}; at full rate again after {again:.2f} s; '
        f'{made_up:+.2f} s made up',
        running.well() and made_up < _MAX_TICK + _INEXACT and (quick or made_up > -_INEXACT),
    )


def flood(running: Live, quick: bool) -> Row:
    """Wind and sphere far more often than there are ticks."""
    rate, seconds, listener = 2000, 2 if quick else 10, running.listener
    # Raw, and only the newest: thousands of points to be read in each would hold up the listener.
    newest: deque[bytes] = deque(maxlen=1)
    markers = listener.create_subscription(
        MarkerArray, '/cloth/markers', lambda message: newest.append(message), 1, raw=True
    )
    listener.spin_until(lambda: newest, SOON)
    peer = running.beside(*PEER, 'flood', str(rate), str(seconds))
    try:
        listener.spin_until(lambda: 'heard' in peer.output)  # its coming is another fault
        before, used, began = running.node.memory, running.node.cpu_seconds, time.monotonic()
        listener.spin_until(lambda: not peer.alive)
        ended = time.monotonic()
        used = running.node.cpu_seconds - used
        again = running.recover(ended, SOON)

        def obeyed() -> bool:
            array = deserialize_message(newest[0], MarkerArray)
            format_value = {marker.ns: marker for marker in array.markers}
            still = format_value['wind'].action == Marker.DELETE
            return still and format_value['sphere'].pose.position.z == LAST

        patience = time.monotonic() + SOON
        while not obeyed():  # not at each message: to read one takes long
            assert time.monotonic() < patience, 'the last command is not obeyed'
            listener.spin_for(0.2)
        ticks, memory = running.ticks(began, ended), running.node.memory - before
        factor = running.least_factor(began, ended)
    finally:
        peer.stop(signal.SIGKILL)
        listener.destroy_subscription(markers)
    return Row(
        f'wind and sphere at {rate} Hz each',
        f'real time is kept: the real-time factor is at least {REAL_TIME:g}, no message is lost; '
        'and the last command of each is obeyed',
        f'{peer.output.splitlines()[-1]} were sent; {ticks.text}; least real-time factor '
        f'{factor:.3f}; at full rate again after {again:.2f} s; '
        f'{100 * used / (ended - began):.0f} % of a core; '
        f'memory {memory:+.1f} MB',
        running.well() and (quick or (ticks.all_arrived and factor >= REAL_TIME)),
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
    try:
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
        listener.spin_until(lambda: all(answer.done() for answer in answers), SOON)
        answered = time.monotonic() - ended
    finally:
        listener.destroy_client(change)
        listener.set_parameters_of_cloth({'wind.air_density': 1.2, 'drag': 0.5})
        kept = running.well()  # which ends a pause
    again = running.recover(ended, SOON)
    return Row(
        f'parameters changed {rate:g} times a second, resets and pauses among them',
        'every request is answered',
        f'{len(answers)} requests, the last answered {answered:.2f} s after the end; '
        f'{running.ticks(began, ended).text}; at full rate again after {again:.2f} s; '
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
    finally:
        for each in hogs:
            each.stop(signal.SIGKILL)
    again = running.recover(time.monotonic(), SOON)
    ticks = running.ticks(began, ended)
    return Row(
        'as many busy processes as cores',
        f'it goes on, and no message is lost; {_WELL} afterwards',
        f'{ticks.text}; least real-time factor {running.least_factor(began, ended):.3f}; at full '
        f'rate again after {again:.2f} s',
        running.well() and (quick or ticks.all_arrived),
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
    again = running.recover(time.monotonic(), SOON)
    return Row(
        'another node of the same name, which ends again',
        'both live, and both say so',
        'both warned, services were answered; alone again, it was at full rate again after '
        f'{again:.2f} s',
        both and running.well(),
    )
