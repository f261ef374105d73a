"""Faults of the process: its clock, network, log folder, signals, and kernels being compiled."""

import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from reliability.live_node import live_node
from ros import NODE, PATIENCE, Process, environment, probing, set_parameters

# What a node prints.
STARTED = 'publishing'
COMPILING, COMPILED = 'needed once on this machine', 'compiled the kernels of'
LONGEST = 3.0  # s, within which signals come: a start takes half of it, compiling more


def test_system_clock_jumps(tmp_path, long, measured):
    """The system clock is set by +1 h and -1 h: ticks go on, stamps follow the clock."""
    compiler = shutil.which('cc')
    if compiler is None:
        pytest.skip('needs a C compiler')
    # A preloaded library changes the clock of the process; that of the machine is left alone.
    library, shift = tmp_path / 'shift.so', tmp_path / 'shift'
    source = Path(__file__).with_name('clock_shift.c')
    command = [compiler, '-shared', '-fPIC', '-O2', '-o', library, source, '-ldl']
    subprocess.run(command, check=True)
    shift.write_bytes(bytes(8))
    variables = {'LD_PRELOAD': str(library), 'CLOCK_SHIFT': str(shift)}
    with (
        live_node(timed=long, variables=variables) as node,
        node.interval(by_arrival=True) as interval,
    ):
        for seconds in (3600, -3600) * (10 if long else 1):
            with shift.open('r+b') as file:
                file.write(struct.pack('q', seconds))
            node.wait_for_stamp(time.time() + seconds)
            recovered = node.recover()
        node.check()
    measured(f'{interval.text}; {recovered}')
    interval.require(real_time=True)


def test_no_network_interface_but_loopback(domain, long, measured):
    """A network namespace with loopback only: a subscriber on the machine receives 60 Hz ± 5 %."""
    enter = ('unshare', '-rn', 'sh', '-c', 'ip link set lo up && exec "$@"', 'sh')
    tools = all(shutil.which(tool) for tool in ('unshare', 'nsenter', 'ip'))
    if not tools or subprocess.run([*enter, 'true'], capture_output=True).returncode:
        pytest.skip('needs unshare, nsenter and ip, and network namespaces')
    # The default range: users without a network should not need to know of the other one.
    variables = {**environment(domain), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
    node = Process((*enter, *NODE), variables)
    watch = None
    try:
        node.wait_for_output(STARTED)
        inside = ('nsenter', '-t', str(node.process.pid), '-U', '-n', '--preserve-credentials')
        command = [*inside, 'ip', '-brief', 'link']
        links = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert len(links.splitlines()) == 1
        watch = Process((*inside, sys.executable, '-u', 'examples/watch.py'), variables)
        watch.wait_for_output(' Hz ')
        while long and watch.alive and watch.output.count(' Hz ') < 3:  # the first is of a start
            time.sleep(0.1)
        rates = [float(rate) for rate in re.findall(r'([\d.]+) Hz ', watch.output)]
        assert node.alive
    finally:
        if watch is not None:
            watch.end()
        node.end()
    measured(f'{rates[-1]:g} Hz')
    assert not long or abs(rates[-1] / 60.0 - 1) <= 0.05


def test_log_folder_that_cannot_be_written(domain, tmp_path):
    """A log folder in which not even root can write: the node starts and warns once, naming it."""
    (tmp_path / 'file').touch()
    below_a_file = str(tmp_path / 'file' / 'log')
    places = (
        (below_a_file, {'ROS_LOG_DIR': below_a_file}),
        ('/proc/nowhere', {'ROS_LOG_DIR': '/proc/nowhere'}),
        (below_a_file, {'HOME': below_a_file, 'ROS_LOG_DIR': '', 'ROS_HOME': ''}),
    )
    nodes = [Process(NODE, {**environment(domain), **variables}) for _, variables in places]
    try:
        for node, (folder, _) in zip(nodes, places, strict=True):
            node.wait_for_output(STARTED)
            node.wait_for_output('no log file')
            (warning,) = re.findall('no log file.*', node.output)
            assert folder in warning
    finally:
        for node in nodes:
            node.end()


def children(process: Process) -> list[Path]:
    """Return the folders in /proc of the child processes, which compile kernels."""
    lists = Path(f'/proc/{process.process.pid}/task').glob('*/children')
    return [Path('/proc', pid) for each in lists for pid in each.read_text().split()]


def times_of(cache: Path | None) -> dict[Path, int]:
    """Return when each kernel in a cache was written."""
    kernels = () if cache is None else cache.rglob('*.nbc')
    return {path: path.stat().st_mtime_ns for path in kernels}


def wait_until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def start(domain: int, cache: Path | None, *arguments: str, compiled: bool = True) -> Process:
    """Start a node with a folder for kernels; wait until it publishes, and has compiled all."""
    variables = {} if cache is None else {'NUMBA_CACHE_DIR': str(cache)}
    node = Process([*NODE, *arguments], {**environment(domain), **variables})
    if compiled:
        node.wait_for_output(STARTED)
        wait_until(lambda: node.output.count(COMPILED) >= node.output.count(COMPILING))
    return node


MOMENTS, LONG = ('first start', 'change'), pytest.mark.long


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize('moment', ['start', *(pytest.param(m, marks=LONG) for m in MOMENTS)])
def test_signals_at_random_moments(moment, number, domain, tmp_path, long, measured):
    """
    Signals during a start, a first start that compiles kernels, and while a changed parameter
    compiles kernels: SIGINT and SIGTERM end the node with exit code 0 and no traceback; its child
    processes end; the next node starts, and compiles only what was not yet cached.
    """
    draw, longest, ends = random.Random(int(number)), 0.0, Counter()
    unchanged = tmp_path / 'unchanged'
    calm = ('--ros-args', '-p', 'wind.air_density:=0.0')
    if moment == 'change':  # kernels that are needed before it
        start(domain, unchanged, *calm).end()
    for n in range(6 if long else 1):
        cache = None if moment == 'start' else tmp_path / str(n)
        if moment == 'change':
            shutil.copytree(unchanged, cache)
        node = start(domain, cache, *calm, compiled=moment == 'change')
        try:
            if moment == 'change':
                with probing(domain) as probe:
                    set_parameters(probe, wind__air_density=1.2, springs__damping=1e-3)
            if moment != 'start':
                wait_until(lambda: children(node))  # noqa: B023
            time.sleep(draw.uniform(0.0, LONGEST if long else 1.0))
            left, began = children(node), time.monotonic()
            code, output = node.stop(number), node.output
            longest = max(longest, time.monotonic() - began)
        finally:
            node.end()
        wait_until(lambda: not any(child.exists() for child in left))  # noqa: B023
        # Before the first line of the node has run, Python ends the process in its own way.
        early = 'cloth_ros' not in output and '[cloth]' not in output
        quiet = 'Traceback' not in output and 'FATAL' not in output
        assert early or code == (-number if number == signal.SIGKILL else 0), output
        assert early or quiet, output
        ends[f'with exit code {code}'] += 1
        if number == signal.SIGKILL:
            cached = times_of(cache)
            assert start(domain, cache, *calm).stop() == 0
            assert cached.items() <= times_of(cache).items()
    text = ', '.join(f'{count} {end}' for end, count in ends.items())
    measured(f'{text}; the longest took {longest:.2f} s')
