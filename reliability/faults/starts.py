"""Faults of where a node starts, and ends at any moment."""

from __future__ import annotations

import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from ..live import NODE, Process, environment, free_domain, live
from ..record import Row
from .cannot import CannotDoError

_SEED = 5
_LONGEST = 3.0  # s after the start, until which signals come; a start takes about half of it


def loopback(quick: bool) -> Row:
    """A network namespace in which there is no interface but loopback."""
    if not all(shutil.which(tool) for tool in ('unshare', 'nsenter', 'ip')):
        raise CannotDoError('needs unshare, nsenter and ip')
    enter = ('unshare', '-rn', 'sh', '-c', 'ip link set lo up && exec "$@"', 'sh')
    if subprocess.run([*enter, 'true'], capture_output=True).returncode:
        raise CannotDoError('network namespaces are not permitted')
    with free_domain() as domain:
        # The default range: whoever has no network should not need to know of the other.
        variables = {**environment(domain), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
        began = time.monotonic()
        node = Process((*enter, *NODE), variables)
        watch = None
        try:
            node.wait_for_output('publishing')
            inside = ('nsenter', '-t', str(node.process.pid), '-U', '-n', '--preserve-credentials')
            interfaces = subprocess.run(
                [*inside, 'ip', '-brief', 'link'], capture_output=True, text=True, check=True
            ).stdout.splitlines()
            watch = Process((*inside, sys.executable, '-u', 'examples/watch.py'), variables)
            watch.wait_for_output(' Hz ')
            heard = time.monotonic() - began
            # The first counts from before it heard.
            while watch.output.count(' Hz ') < 3 and watch.alive:
                time.sleep(0.1)
            rate = watch.output.splitlines()[-1].split()[0]
            measured = f'{rate} Hz are heard, the first {heard:.1f} s after the start'
            kept = len(interfaces) == 1 and node.alive
        finally:
            if watch is not None:
                watch.end()
            node.end()
    return Row(
        'no network interface but loopback',
        'a subscriber on the machine is served as ever',
        measured,
        kept,
    )


def log_folder(quick: bool) -> Row:
    """Places in which not even root can write."""
    told = 0
    with tempfile.NamedTemporaryFile() as file, free_domain() as domain:
        below_a_file = f'{file.name}/log'
        places = (
            {'ROS_LOG_DIR': below_a_file},
            {'ROS_LOG_DIR': '/proc/nowhere'},
            {'HOME': below_a_file, 'ROS_LOG_DIR': '', 'ROS_HOME': ''},
        )
        nodes = [Process(NODE, {**environment(domain), **place}) for place in places]
        try:
            for node in nodes:
                node.wait_for_output('publishing')
                node.wait_for_output('no log file')
                told += 1
        finally:
            for node in nodes:
                node.end()
    return Row(
        'a log folder that cannot be written',
        'the node starts, and says so',
        f'{told} of {len(places)} places: it runs, warns once, and names the folder',
        told == len(places),
    )


def signals(quick: bool) -> Row:
    """SIGINT, SIGTERM and SIGKILL at random moments, and a restart after each."""
    draw = random.Random(_SEED)
    times = 1 if quick else 12
    ends: Counter[str] = Counter()
    longest, bad = 0.0, ''
    with free_domain() as domain:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL) * times:
            node = Process(NODE, environment(domain))
            time.sleep(draw.uniform(0.0, _LONGEST))
            began = time.monotonic()
            code, output = node.stop(number), node.output
            longest = max(longest, time.monotonic() - began)
            # Before its own first line has run, Python ends a process in its own way.
            early = 'cloth_ros' not in output and '[cloth]' not in output
            clean = code == (-number if number == signal.SIGKILL else 0)
            quiet = 'Traceback' not in output and 'FATAL' not in output
            if not (clean and quiet) and not early:
                bad += f'; {number.name}: {output[-500:]}'
            ends['cleanly' if clean else f'before it was a node ({code})'] += 1
    began = time.monotonic()
    with live() as running:
        again = running.listener.particles[0].at - began
        kept = running.well() and not bad
    return Row(
        'SIGINT, SIGTERM and SIGKILL at random moments, a restart after each',
        'it ends at once, without a traceback; the next one starts and runs',
        f'{sum(ends.values())} ends: {", ".join(f"{n} {how}" for how, n in ends.items())}; the '
        f'longest took {longest:.2f} s; messages {again:.1f} s after the last restart{bad}',
        kept,
    )


def compiling(quick: bool) -> Row:
    """SIGKILL while kernels are compiled and written to the cache."""
    draw = random.Random(_SEED)
    with tempfile.TemporaryDirectory() as cache, free_domain() as domain:
        variables = {**environment(domain), 'NUMBA_CACHE_DIR': cache}
        moments = [draw.uniform(1.0, 12.0) for _ in range(4)]
        files = []
        for moment in moments:
            node = Process(NODE, variables)
            time.sleep(moment)
            node.stop(signal.SIGKILL)
            files.append(sum(1 for path in Path(cache).rglob('*.nbc')))
        node = Process(NODE, variables)
        try:
            node.wait_for_output('publishing')
            clean = 'Traceback' not in node.output
        finally:
            clean &= node.stop() == 0
    return Row(
        'SIGKILL while kernels are compiled and cached, and a restart with that cache',
        'what was cached is used, the rest is compiled',
        f'killed after {", ".join(f"{each:.1f}" for each in moments)} s with '
        f'{", ".join(map(str, files))} kernels cached; the restart ran',
        clean,
    )
