"""Faults of the process: clocks, network, log folder, signals, and errors inside the node."""

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
from itertools import count, repeat
from pathlib import Path

import pytest
from builtin_interfaces.msg import Time
from reliability.live_node import live_node
from ros import NODE, PATIENCE, Process, diagnosis, probing, publish_until, set_parameters
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2

# Live nodes beside faults take minutes, and are no news after each small change.
pytestmark = pytest.mark.slow

# What a node prints.
STARTED = 'publishing'
COMPILING, COMPILED = 'they are kept on disk', 'compiled the kernels of'
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


def test_no_network_interface_but_loopback(start, long, measured):
    """A network namespace with loopback only: a subscriber on the machine receives 60 Hz ± 5 %."""
    enter = ('unshare', '-rn', 'sh', '-c', 'ip link set lo up && exec "$@"', 'sh')
    tools = all(shutil.which(tool) for tool in ('unshare', 'nsenter', 'ip'))
    if not tools or subprocess.run([*enter, 'true'], capture_output=True).returncode:
        pytest.skip('needs unshare, nsenter and ip, and network namespaces')
    # The default range: users without a network should not need to know of the other one.
    variables = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
    node = start(*enter, *NODE, **variables)
    node.wait_for_output(STARTED)
    inside = ('nsenter', '-t', str(node.process.pid), '-U', '-n', '--preserve-credentials')
    command = [*inside, 'ip', '-brief', 'link']
    links = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert len(links.splitlines()) == 1
    watch = start(*inside, sys.executable, '-u', 'examples/watch.py', **variables)
    wait_until(lambda: watch.output.count(' Hz ') >= (3 if long else 1))  # the first is of a start
    rate = float(re.findall(r'([\d.]+) Hz ', watch.output)[-1])
    measured(f'{rate:g} Hz')
    assert not long or abs(rate / 60.0 - 1) <= 0.05


def test_log_folder_that_cannot_be_written(start, tmp_path):
    """A log folder in which not even root can write: the node starts and warns once, naming it."""
    (tmp_path / 'file').touch()
    below_a_file = str(tmp_path / 'file' / 'log')
    places = (
        (below_a_file, {'ROS_LOG_DIR': below_a_file}),
        ('/proc/nowhere', {'ROS_LOG_DIR': '/proc/nowhere'}),
        (below_a_file, {'HOME': below_a_file, 'ROS_LOG_DIR': '', 'ROS_HOME': ''}),
    )
    for node, folder in [(start(*NODE, **variables), folder) for folder, variables in places]:
        node.wait_for_output(STARTED)
        node.wait_for_output('no log file')
        (warning,) = re.findall('no log file.*', node.output)
        assert folder in warning


def wait_until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def children(process: Process) -> list[Path]:
    """Return the folders in /proc of the child processes, which compile kernels."""
    lists = Path(f'/proc/{process.process.pid}/task').glob('*/children')
    return [Path('/proc', pid) for each in lists for pid in each.read_text().split()]


def compiled(node: Process) -> bool:
    return STARTED in node.output and node.output.count(COMPILED) >= node.output.count(COMPILING)


def times_of(cache: Path) -> dict[Path, int]:
    """Return when each kernel in a cache was written."""
    return {path: path.stat().st_mtime_ns for path in cache.rglob('*.nbc')}


MOMENTS = [pytest.param(moment, marks=pytest.mark.long) for moment in ('first start', 'change')]


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize('moment', ['start', *MOMENTS])
def test_signals_at_random_moments(moment, number, start, domain, tmp_path, long, measured):
    """
    Signals during a start, a first start that compiles kernels, and while a changed parameter
    compiles kernels: SIGINT and SIGTERM end the node with exit code 0 and no traceback; its child
    processes end; the next node starts, and compiles only what was not yet cached.
    """
    draw, longest, ends = random.Random(int(number)), 0.0, Counter()
    unchanged = tmp_path / 'unchanged'

    def start_node(cache: Path, *, wait: bool) -> Process:
        variables = {} if moment == 'start' else {'NUMBA_CACHE_DIR': str(cache)}
        node = start(*NODE, '--ros-args', '-p', 'wind.air_density:=0.0', **variables)
        if wait:
            wait_until(lambda: compiled(node))
        return node

    if moment == 'change':  # kernels that are needed before it
        start_node(unchanged, wait=True).stop()
    for n in range(6 if long else 1):
        cache = tmp_path / str(n)
        if moment == 'change':
            shutil.copytree(unchanged, cache)
        node = start_node(cache, wait=moment == 'change')
        if moment == 'change':
            with probing(domain) as probe:
                set_parameters(probe, wind__air_density=1.2, springs__damping=1e-3)
        if moment != 'start':
            wait_until(lambda: children(node))  # noqa: B023
        time.sleep(draw.uniform(0.0, LONGEST if long else 1.0))
        left, began = children(node), time.monotonic()
        code, output = node.stop(number), node.output
        longest = max(longest, time.monotonic() - began)
        wait_until(lambda: not any(child.exists() for child in left))  # noqa: B023
        # Before the node handles signals, Python ends the process in its own way.
        early = not output or 'KeyboardInterrupt' in output
        assert early or code == (-number if number == signal.SIGKILL else 0), output
        assert early or not ('Traceback' in output or 'FATAL' in output), output
        ends[f'with exit code {code}'] += 1
        if number == signal.SIGKILL:
            cached = times_of(cache)
            assert start_node(cache, wait=True).stop() == 0
            assert cached.items() <= times_of(cache).items()
    text = ', '.join(f'{count} {end}' for end, count in ends.items())
    measured(f'{text}; the longest took {longest:.2f} s')


NOT_SENT = """
import sys
from itertools import count
from rclpy.impl.implementation_singleton import rclpy_implementation
from cloth_ros.node import publisher
from cloth_ros.node.main import main

publish, tries = publisher.publish_bytes, count()

def failing(handle, data):
    if 'particles' in handle.topic_name and next(tries) < 10:
        raise rclpy_implementation.RCLError('failed to publish: a time-out')
    publish(handle, data)

publisher.publish_bytes = failing
sys.exit(main())
"""


def test_a_message_that_cannot_be_sent(start, probe):
    """A message that cannot be sent: the node goes on, warns once, and counts it."""
    node = start(sys.executable, '-c', NOT_SENT)
    node.wait_for_output('publishing')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(particles) > 5)
    assert node.output.count('a message on particles was not sent') == 1
    assert diagnosis(probe)['messages not sent'] == '10'


FAILING = """
import sys
from cloth_ros import Cloth
from cloth_ros.node.main import main

def advance_stepwise(self, *arguments, **keywords):
    raise ZeroDivisionError('unforeseen')

Cloth.advance_stepwise = advance_stepwise
sys.exit(main())
"""


def test_an_unforeseen_error(start):
    """An unforeseen error in the model: the node ends with it, and does not go on."""
    node = start(sys.executable, '-c', FAILING)
    assert node.stop(0, patience=240.0) == 1
    assert 'ZeroDivisionError: unforeseen' in node.output


def test_a_clock_that_is_no_time(start_cloth, probe):
    """Invalid times on the /clock that a node starts with: refused; the last valid second, not."""
    node = start_cloth(use_sim_time='true')
    clock = probe.publisher(Clock, '/clock')
    for sec, nanosec in ((-1, 0), (-(2**31), 2**32 - 1), (2**31 - 1, 2**32 - 1), (5, 10**9)):
        clock.publish(Clock(clock=Time(sec=sec, nanosec=nanosec)))
    publish_until(lambda: 'rejected a message on /clock' in node.output, probe, clock,
                  repeat(Clock(clock=Time(sec=-1))))  # fmt: skip
    particles = probe.collect(PointCloud2, '/cloth/particles')
    for sec in (2**31 - 1, 7):
        publish_until(
            lambda: particles and particles[-1].header.stamp.sec == sec,  # noqa: B023
            probe,
            clock,
            (Clock(clock=Time(sec=sec, nanosec=n * 25_000_000 % 10**9)) for n in count()),
        )
    assert node.alive
