"""Faults of the clocks."""

from __future__ import annotations

import shutil
import struct
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rosgraph_msgs.msg import Clock

from ..arrivals import REAL_TIME
from ..live import SOON, Listener, Live, live
from ..record import Row
from .cannot import CannotDoError

_CLOCK_RATE = 200.0  # Hz
_FIRST = 5000.0  # s, of /clock
_APART = 0.5  # s, by which simulated time may miss what /clock has gone on by between jumps


class SystemClock:
    """
    The system clock of a process that is started with `variables`; the machine's is left alone.

    A preloaded library stands between the process and the clock, see clock_shift.c.
    """

    def __init__(self, folder: str) -> None:
        compiler = shutil.which('cc')
        if compiler is None:
            raise CannotDoError('needs a C compiler')
        source, library = Path(__file__).with_name('clock_shift.c'), Path(folder) / 'shift.so'
        command = [compiler, '-shared', '-fPIC', '-O2', '-o', str(library), str(source), '-ldl']
        subprocess.run(command, check=True)
        self._file = Path(folder) / 'shift'
        self.shift(0)
        self.variables = {'LD_PRELOAD': str(library), 'CLOCK_SHIFT': str(self._file)}

    def shift(self, seconds: int) -> None:
        """Have the clock be so many seconds ahead of the machine's."""
        with self._file.open('r+b' if self._file.exists() else 'wb') as file:
            file.write(struct.pack('q', seconds))


def system_clock(quick: bool) -> Row:
    """The system clock jumps forward and backward."""
    times = 2 if quick else 10
    with tempfile.TemporaryDirectory() as folder:
        clock = SystemClock(folder)
        with live(variables=clock.variables) as running:
            began, again = time.monotonic(), []
            for shift in (3600, -3600) * times:
                clock.shift(shift)
                jumped = time.monotonic()
                running.spin_until_stamped(time.time() + shift)
                again.append(running.recover(jumped, SOON))
            ended = time.monotonic()
            ticks = running.ticks(began, ended, by_arrival=True)
            factor = running.least_factor(began, ended)
            kept = running.well() and (quick or (ticks.all_arrived and factor >= REAL_TIME))
    return Row(
        f'the system clock is set an hour ahead and then an hour behind, {times} times',
        'ticks and simulated time go on: no message is lost, the real-time factor is at least '
        f'{REAL_TIME:g}; stamps follow the clock',
        f'{ticks.text}; least real-time factor {factor:.3f}; at full rate again after '
        f'{max(again):.2f} s',
        kept,
    )


class SimulatedClock:
    """
    Publishes /clock to a node that follows it, as a simulator does.

    It goes on by the same step each time, at the rate of real time: where its own process is held
    up, /clock stands still, and does not jump.

    Attributes
    ----------
    now
        What it shows, s.
    still
        True to publish nothing.

    """

    def __init__(self, listener: Listener) -> None:
        self.now = _FIRST
        self.still = False
        self._publisher = listener.publisher(Clock, '/clock')
        self._timer = listener.create_timer(1 / _CLOCK_RATE, self._publish)

    def _publish(self) -> None:
        if self.still:
            return
        self.now += 1 / _CLOCK_RATE
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(int(1e9 * self.now), 10**9)
        self._publisher.publish(message)

    def end(self, listener: Listener) -> None:
        """Publish no more."""
        listener.destroy_timer(self._timer)
        listener.destroy_publisher(self._publisher)


@contextmanager
def _simulated_time(running: Live) -> Iterator[SimulatedClock]:
    """Have the node follow a /clock."""
    listener = running.listener
    listener.set_parameters_of_cloth({'use_sim_time': True})
    try:
        clock = SimulatedClock(listener)
        try:
            running.recover(time.monotonic(), SOON)
            yield clock
        finally:
            clock.end(listener)
    finally:
        listener.set_parameters_of_cloth({'use_sim_time': False})
    running.recover(time.monotonic(), SOON)


def clock_jumps(running: Live, quick: bool) -> Row:
    """/clock jumps forward and backward."""
    again, apart = [], []
    before = running.node.output.count('slow motion')
    with _simulated_time(running) as clock:
        for jump in (1000.0, -2000.0):
            simulated, format_value = running.next_report().simulated, clock.now
            clock.now += jump
            jumped = time.monotonic()
            running.spin_until_stamped(clock.now)
            again.append(running.recover(jumped, SOON))
            simulated = running.next_report().simulated - simulated
            apart.append(simulated - (clock.now - jump - format_value))
        slow = running.node.output.count('slow motion') - before
    return Row(
        '/clock jumps 1000 s ahead, then 2000 s back',
        'ticks follow it; simulated time goes on as if there had been no jump, within '
        f'{_APART:g} s; none is called lost',
        f'{" and ".join(f"{each:+.2f} s" for each in apart)} simulated at the jumps; at full rate '
        f'again after {max(again):.2f} s; {slow} warnings of slow motion',
        running.well() and not slow and max(map(abs, apart)) < _APART,
    )


def clock_stands(running: Live, quick: bool) -> Row:
    """/clock stands still, and goes on where it stood."""
    seconds = 2.5 if quick else 10.0
    with _simulated_time(running) as clock:
        listener = running.listener
        clock.still = True
        listener.spin_for(0.5)  # what is on its way
        before = len(listener.particles)
        listener.spin_for(seconds)
        meanwhile = len(listener.particles) - before
        said = 'is there a /clock?' in listener.reports[-1].message
        clock.still = False
        again = running.recover(time.monotonic(), SOON)
    return Row(
        f'/clock stands still for {seconds:g} s',
        'so does the cloth, and the diagnostics say why; it goes on with /clock',
        f'{meanwhile} messages meanwhile; at full rate again after {again:.2f} s',
        running.well() and meanwhile == 0 and said,
    )
