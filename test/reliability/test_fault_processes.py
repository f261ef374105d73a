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
from pathlib import Path

import pytest
from reliability.live_node import live_node
from ros import NODE, Process, environment, probing, set_parameters

# What a node prints.
STARTED = 'publishing'
COMPILING, COMPILED = 'needed once on this machine', 'compiled the kernels of'
LONGEST = 3.0  # s, within which signals come: a start takes half of it, compiling more


def quiet(output: str) -> bool:
    return 'Traceback' not in output and 'FATAL' not in output


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


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL],
                         ids=lambda number: number.name)  # fmt: skip
def test_signals_at_random_moments(number, domain, long, measured):
    """SIGINT and SIGTERM end the node with exit code 0; after SIGKILL the next one starts."""
    draw, longest, ends = random.Random(int(number)), 0.0, Counter()
    for _ in range(12 if long else 1):
        node = Process(NODE, environment(domain))
        try:
            time.sleep(draw.uniform(0.0, LONGEST if long else 1.0))
            began = time.monotonic()
            code, output = node.stop(number), node.output
            longest = max(longest, time.monotonic() - began)
        finally:
            node.end()
        # Before the first line of the node has run, Python ends the process in its own way.
        early = 'cloth_ros' not in output and '[cloth]' not in output
        if number != signal.SIGKILL:
            assert early or (code == 0 and quiet(output)), (code, output)
        ends[f'with exit code {code}'] += 1
        if number == signal.SIGKILL:
            node = Process(NODE, environment(domain))
            try:
                node.wait_for_output(STARTED)
            finally:
                node.end()
    text = ', '.join(f'{count} {end}' for end, count in ends.items())
    measured(f'{text}; the longest took {longest:.2f} s')


def children(process: Process) -> list[Path]:
    """Return the folders in /proc of the child processes, which compile kernels."""
    lists = Path(f'/proc/{process.process.pid}/task').glob('*/children')
    return [Path('/proc', pid) for each in lists for pid in each.read_text().split()]


def wait_until_gone(processes: list[Path]) -> None:
    end = time.monotonic() + 60.0
    while any(each.exists() for each in processes):
        assert time.monotonic() < end, 'child processes are left'
        time.sleep(0.05)


def compiled(cache: Path) -> dict[Path, int]:
    """Return the compiled kernels in a cache, and when they were written."""
    return {path: path.stat().st_mtime_ns for path in cache.rglob('*.nbc')}


@pytest.mark.long
def test_killed_while_kernels_are_compiled(domain, tmp_path, measured):
    """SIGKILL while kernels are compiled: children end too; a restart compiles the rest only."""
    kills, counts = 4, []
    for kill in range(kills + 1):
        cache = tmp_path / str(kill)  # empty
        variables = {'NUMBA_CACHE_DIR': str(cache)}
        node = Process(NODE, {**environment(domain), **variables})
        try:
            node.wait_for_output(COMPILING)
            began = time.monotonic()
            if kill == 0:  # not killed, to measure how long it takes
                while node.output.count(COMPILED) < node.output.count(COMPILING):
                    time.sleep(0.1)
                whole = time.monotonic() - began
                full = len(compiled(cache))
                continue
            time.sleep(whole * kill / (kills + 1))
            left = children(node)
            assert left, 'killed too late'
        finally:
            node.stop(signal.SIGINT if kill == 0 else signal.SIGKILL)
        wait_until_gone(left)
        before = compiled(cache)
        with live_node(timed=True, variables=variables) as restarted:
            restarted.check()
            assert restarted.process.stop() == 0
        assert quiet(restarted.process.output), restarted.process.output
        again = {path: written for path, written in compiled(cache).items() if path in before}
        assert again == before
        counts.append(len(before))
    measured(
        f'killed {kills} times in the {whole:.1f} s in which {full} kernels are compiled: '
        f'{", ".join(map(str, counts))} were cached, and not compiled again'
    )


@pytest.mark.long
def test_signals_while_kernels_are_compiled_in_the_background(domain, tmp_path, measured):
    """SIGINT and SIGTERM while a parameter change compiles kernels: exit code 0, no traceback."""
    draw, longest, times = random.Random(0), 0.0, 10
    command = (*NODE, '--ros-args', '-p', 'wind.air_density:=0.0')

    def start(cache: Path) -> Process:
        node = Process(command, {**environment(domain), 'NUMBA_CACHE_DIR': str(cache)})
        node.wait_for_output(STARTED)
        while node.output.count(COMPILED) < node.output.count(COMPILING):
            time.sleep(0.1)
        return node

    unchanged = tmp_path / 'unchanged'
    start(unchanged).end()  # compiles what is needed before the change
    for n, number in enumerate((signal.SIGINT, signal.SIGTERM) * times):
        cache = tmp_path / str(n)
        shutil.copytree(unchanged, cache)
        node = start(cache)
        try:
            with probing(domain) as probe:
                results = set_parameters(probe, wind__air_density=1.2, springs__damping=1e-3)
            assert all(result.successful for result in results), results
            node.wait_for_output('compiling kernels for the changed parameters')
            time.sleep(draw.uniform(0.0, LONGEST))
            left = children(node)
            assert left, 'too late'
            began = time.monotonic()
            assert node.stop(number) == 0, node.output
            longest = max(longest, time.monotonic() - began)
        finally:
            node.end()
        wait_until_gone(left)
        assert quiet(node.output), node.output
    measured(f'{2 * times} ends, the longest took {longest:.2f} s')
