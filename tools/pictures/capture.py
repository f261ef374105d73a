"""
States of a scene as a running node publishes them.

The node follows /clock, which moves on when a state has come: the times of the states do not
depend on the speed of the machine.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped
from numpy.typing import NDArray
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

from examples.fold_towel import GRIPPERS, State

from .moments import Action, Motion

sys.path.insert(0, str(Path(__file__).parents[2] / 'test'))
from ros import NODE, Probe, Process, environment, free_domain, numbers, probing

RATE = 60  # Hz, of ticks and markers
_RESEND = 0.05  # s, after which a message on /clock, which is best effort, is sent again
_START = 0.5  # s, between times on /clock until the node has discovered it
_LONGEST_START = 300.0  # s, until the first state: the node may have to compile kernels
_LONGEST = (
    20.0  # s, of a tick; if it takes longer, a message was lost or the node has no processor
)
# Time, s, from one state to the next time on /clock, in each attempt: a node that has less time
# for a tick than it needs leaves out a part of the simulated time.
_PAUSES = (0.0, 0.05, 0.1, 0.2, 0.4)


class Frame(NamedTuple):
    """
    What the node published at one time.

    Attributes
    ----------
    positions
        Of the particles, m, shape (rows, columns, 3).
    markers
        Pins and colliders.

    """

    positions: NDArray[np.float32]
    markers: list[Marker]


class SteppedNode:
    """A node that follows /clock, which moves on only after it has published the last time."""

    def __init__(self, process: Process, probe: Probe) -> None:
        self._process, self._probe = process, probe
        self._now = 10**12  # ns
        self._newest: dict[type, PointCloud2 | MarkerArray] = {}
        for kind, topic in ((PointCloud2, '/cloth/particles'), (MarkerArray, '/cloth/markers')):
            probe.create_subscription(kind, topic, self._take, 10)
        self._clock = probe.publisher(Clock, '/clock')
        self._poses: dict[str, object] = {}

    def _take(self, message: PointCloud2 | MarkerArray) -> None:
        self._newest[type(message)] = message

    def _arrived(self) -> bool:
        """Return whether particles and markers of the present time have come."""
        cloud, array = self._newest.get(PointCloud2), self._newest.get(MarkerArray)
        if cloud is None or array is None or array.markers[0].action == Marker.DELETEALL:
            return False
        stamps = (cloud.header.stamp, array.markers[0].header.stamp)
        # The stamp is the time of the state, which may lack a part of a substep.
        late = [abs(each.sec * 10**9 + each.nanosec - self._now) for each in stamps]
        return max(late) < 0.5e9 / RATE

    def _move_clock(self) -> None:
        """Move /clock by one tick."""
        self._now += round(1e9 / RATE)

    def _send_clock(self, seconds: float) -> None:
        """Publish /clock, and handle messages until the state of that time or for so long."""
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(self._now, 10**9)
        self._clock.publish(message)
        end = time.monotonic() + seconds
        self._probe.spin_until(lambda: self._arrived() or time.monotonic() > end)

    def start(self) -> None:
        """Move /clock until the first state comes: the node ticks from the second time on."""
        end = time.monotonic() + _LONGEST_START
        while not self._arrived():
            if time.monotonic() > end or not self._process.alive:
                raise SystemExit(f'the node publishes nothing: {self._process.output}')
            self._move_clock()
            self._send_clock(_START)

    def tick(self, pause: float = 0.0) -> bool:
        """Wait, s, and move /clock by one tick; return whether the state of that time came."""
        self._probe.spin_for(pause)
        self._move_clock()
        end = time.monotonic() + _LONGEST
        while not self._arrived() and time.monotonic() < end and self._process.alive:
            self._send_clock(_RESEND)
        return self._arrived()

    @property
    def alive(self) -> bool:
        """Whether the node runs."""
        return self._process.alive

    @property
    def output(self) -> str:
        """What the node has printed."""
        return self._process.output

    @property
    def held(self) -> bool:
        """Whether the cloth is held until kernels are compiled."""
        output = self._process.output
        return output.count('the cloth is held') > output.count('the cloth is no longer held')

    def command(self, action: Action) -> None:
        """Publish targets of colliders and grippers, and close or open the grippers."""
        for topic, message in action.targets.items():
            if topic not in self._poses:
                self._poses[topic] = self._probe.publisher(PoseStamped, f'/{topic}')
            self._poses[topic].publish(message)
        if action.grasp is not None:
            for name in GRIPPERS:
                request = SetBool.Request(data=action.grasp)
                answer = self._probe.call(SetBool, f'/{name}/grasp', request)
                if not answer.success:
                    raise SystemExit(answer.message)

    def reset(self) -> None:
        """Return to the initial state."""
        self._probe.call(Trigger, '/cloth/reset', Trigger.Request())

    def frame(self) -> Frame:
        """Return the state that was published last."""
        other = ('sheet', 'wind', 'springs')
        wanted = [
            each
            for each in self._newest[MarkerArray].markers
            if each.action == Marker.ADD and each.ns not in other
        ]
        return Frame(numbers(self._newest[PointCloud2])[..., :3].copy(), wanted)


@contextmanager
def stepped_node(scene: Path) -> Iterator[SteppedNode]:
    """Run a node with a scene, in a ROS domain of its own."""
    settings = {'use_sim_time': 'true', 'rate': float(RATE), 'markers.rate': float(RATE)}
    settings['clock.publish'] = 'false'  # a scene may make the node the clock
    command = [*NODE, '--ros-args', '--params-file', str(scene)]
    for name, value in settings.items():
        command += ['-p', f'{name}:={value}']
    with free_domain() as domain:
        process = Process(command, environment(domain))
        try:
            process.wait_for_output('publishing')
            with probing(domain) as probe:
                yield SteppedNode(process, probe)
        finally:
            process.end()


def _run(
    node: SteppedNode, ticks: Sequence[int], motion: Motion | None, pause: float
) -> list[Frame] | None:
    """Return the states after so many ticks; None if one is missing or the cloth was held."""
    node.reset()
    frames = {}
    actions = None
    for tick in range(1, max(ticks) + 1):
        if not node.tick(pause) or node.held:
            return None
        frame = node.frame()
        if tick in ticks:
            frames[tick] = frame
        if motion is not None:
            state = State(tick / RATE, frame.positions.astype(float))
            actions = actions or motion(state)
            with suppress(StopIteration):  # at the end of a motion all stays as it is
                node.command(actions.send(None if tick == 1 else state))
    return [frames[tick] for tick in ticks]


def capture(scene: Path, seconds: Sequence[float], motion: Motion | None = None) -> list[Frame]:
    """
    Return what a node with a scene publishes at some times.

    Parameters
    ----------
    scene
        Scene file.
    seconds
        Simulated times, s, ascending; rounded to ticks.
    motion
        What is commanded after each tick.

    Raises
    ------
    SystemExit
        The node ends, or does not publish every state in several attempts.

    """
    ticks = [max(round(RATE * each), 1) for each in seconds]
    with stepped_node(scene) as node:
        node.start()
        for pause in _PAUSES:
            frames = _run(node, ticks, motion, pause)
            if frames is not None:
                return frames
            while node.held and node.alive:  # until its kernels are compiled
                time.sleep(0.5)
                node.tick()
        raise SystemExit(f'the node does not publish every state: {node.output}')
