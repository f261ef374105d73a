"""Faults of where a node starts, and ends at any moment."""

from __future__ import annotations

import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from ..live import NODE, Process, environment, free_domain, live, probing
from ..record import Row
from .cannot import CannotDoError

_SEED = 5
_LONGEST = 3.0  # s, within which signals come; a start takes half of it, and compiling more
_RATE, _RATE_APART = 60.0, 0.05  # Hz, that a node has by itself, and share by which it may differ
_COMPILING, _STARTED = 'preparing the kernels of', 'publishing'  # what a node says
_LINES = 3  # of what a subscriber says each second; the first counts from before it heard


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
            node.wait_for_output(_STARTED)
            inside = ('nsenter', '-t', str(node.process.pid), '-U', '-n', '--preserve-credentials')
            interfaces = subprocess.run(
                [*inside, 'ip', '-brief', 'link'], capture_output=True, text=True, check=True
            ).stdout.splitlines()
            watch = Process((*inside, sys.executable, '-u', 'examples/watch.py'), variables)
            watch.wait_for_output(' Hz ')
            heard = time.monotonic() - began
            while watch.output.count(' Hz ') < _LINES and watch.alive:
                time.sleep(0.1)
            rates = [float(rate) for rate in re.findall(r'([\d.]+) Hz ', watch.output)]
            measured = f'{rates[-1]:g} Hz are heard, the first {heard:.1f} s after the start'
            regular = len(rates) >= _LINES and abs(rates[-1] / _RATE - 1) <= _RATE_APART
            kept = len(interfaces) == 1 and node.alive and (quick or regular)
        finally:
            if watch is not None:
                watch.end()
            node.end()
    return Row(
        'no network interface but loopback',
        f'a subscriber on the machine hears {_RATE:g} Hz, within {100 * _RATE_APART:g} %',
        measured,
        kept,
    )


def log_folder(quick: bool) -> Row:
    """Places in which not even root can write."""
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
                node.wait_for_output(_STARTED)
                node.wait_for_output('no log file')
        finally:
            for node in nodes:
                node.end()
    told = 0
    for node, folder in zip(nodes, (below_a_file, '/proc/nowhere', below_a_file), strict=True):
        warnings = re.findall('no log file.*', node.output)
        told += len(warnings) == 1 and folder in warnings[0]
    return Row(
        'a log folder that cannot be written',
        'the node starts, warns of it once, and names the folder',
        f'so in {told} of {len(places)} places',
        told == len(places),
    )


def _is_quiet(output: str) -> bool:
    return 'Traceback' not in output and 'FATAL' not in output


def signals(quick: bool) -> Row:
    """SIGINT, SIGTERM and SIGKILL at random moments, and a restart after each SIGKILL."""
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
            if number == signal.SIGKILL:
                node = Process(NODE, environment(domain))
                try:
                    node.wait_for_output(_STARTED)
                finally:
                    node.end()
                continue
            longest = max(longest, time.monotonic() - began)
            # Before its own first line has run, Python ends a process in its own way.
            early = 'cloth_ros' not in output and '[cloth]' not in output
            if not (code == 0 and _is_quiet(output)) and not early:
                bad += f'; {number.name}: exit code {code}, {output[-500:]}'
            ends['with exit code 0' if code == 0 else f'before it was a node ({code})'] += 1
    began = time.monotonic()
    with live() as running:
        again = running.listener.particles[0].at - began
        kept = running.well() and not bad
    return Row(
        'SIGINT, SIGTERM and SIGKILL at random moments',
        'SIGINT and SIGTERM end it at once, with exit code 0 and without a traceback; after '
        'SIGKILL the next one starts',
        f'{sum(ends.values())} ends by SIGINT and SIGTERM: '
        f'{", ".join(f"{n} {how}" for how, n in ends.items())}, the longest took {longest:.2f} s; '
        f'{times} starts after {times} SIGKILL; messages {again:.1f} s after the last start{bad}',
        kept,
    )


def _saved(node: Process) -> int:
    """Return how many kernels a node has compiled and cached for its start."""
    return node.output.partition(_STARTED)[0].count('[cache] data saved to')


def compiling(quick: bool) -> Row:
    """SIGKILL while kernels are compiled and written to the cache."""
    kills = 1 if quick else 4
    left, anew, bad = [], [], ''
    with tempfile.TemporaryDirectory() as folder, free_domain() as domain:
        for kill in range(kills + 1):
            # Empty at first.  Numba says what it writes there.
            cache = Path(folder, str(kill))
            variables = {'NUMBA_CACHE_DIR': str(cache), 'NUMBA_DEBUG_CACHE': '1'}
            variables['PYTHONUNBUFFERED'] = '1'
            node = Process(NODE, {**environment(domain), **variables})
            try:
                node.wait_for_output(_COMPILING)
                began = time.monotonic()
                if kill == 0:  # this one is let be, to see how long it takes
                    node.wait_for_output(_STARTED)
                    whole, full = time.monotonic() - began, _saved(node)
                    continue
                time.sleep(whole * kill / (kills + 1))
                if _STARTED in node.output:
                    bad += '; killed too late'
            finally:
                node.stop(signal.SIGINT if kill == 0 else signal.SIGKILL)
            left.append(sum(1 for _ in cache.rglob('*.nbc')))
            with live(variables=variables) as running:
                anew.append(_saved(running.node))
                well, code = running.well(), running.node.stop()
            if not (well and code == 0 and _is_quiet(running.node.output)):
                bad += f'; exit code {code}: {running.node.output[-500:]}'
    return Row(
        'SIGKILL while kernels are compiled and cached, and a restart with what is cached then',
        'it starts, and ticks at full rate; no kernel that was cached is compiled again',
        f'killed {kills} times, evenly in the {whole:.1f} s in which {full} kernels are compiled, '
        f'each time from an empty cache: {", ".join(map(str, left))} were cached, '
        f'{", ".join(map(str, anew))} were compiled in the restart{bad}',
        not bad and all(new + old <= full for new, old in zip(anew, left, strict=True)),
    )


def changing(quick: bool) -> Row:
    """SIGINT and SIGTERM while kernels are compiled beside a running cloth."""
    draw = random.Random(_SEED)
    times = 1 if quick else 10
    change = {'wind.air_density': 1.2, 'springs.damping': 1e-3}
    command = (*NODE, '--ros-args', '-p', 'wind.air_density:=0.0')
    longest, ends, good, bad = 0.0, 0, 0, ''
    with tempfile.TemporaryDirectory() as folder, free_domain() as domain:

        def start(cache: Path) -> Process:
            node = Process(command, {**environment(domain), 'NUMBA_CACHE_DIR': str(cache)})
            node.wait_for_output(_STARTED)
            return node

        unchanged = Path(folder, 'unchanged')  # what is compiled before the change
        start(unchanged).end()
        for number in (signal.SIGINT, signal.SIGTERM) * times:
            cache = Path(folder, str(ends))
            shutil.copytree(unchanged, cache)
            node = start(cache)
            try:
                with probing(domain) as probe:
                    results = probe.set_parameters_of_cloth(change)
                assert all(result.successful for result in results), results
                node.wait_for_output('compiling kernels for what has changed')
                time.sleep(draw.uniform(0.0, _LONGEST))
                # The solution is said at the start, and when the change takes effect.
                assert node.output.count('stability limit') == 1, node.output
                began = time.monotonic()
                code = node.stop(number)
                longest = max(longest, time.monotonic() - began)
            finally:
                node.end()
            ends += 1
            if code == 0 and _is_quiet(node.output):
                good += 1
            else:
                bad += f'; {number.name}: exit code {code}, {node.output[-500:]}'
    return Row(
        'SIGINT and SIGTERM while kernels are compiled beside a running cloth',
        'it ends with exit code 0 and without a traceback',
        f'{ends} ends, {good} so; the longest took {longest:.2f} s{bad}',
        good == ends,
    )
