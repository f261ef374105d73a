"""
The topic /clock, where the node is the clock of the simulation: the simulated time of the cloth.

The clock of the node itself is set to that time, so that all its stamps are in it.  Ticks follow
the steady clock.
"""

from __future__ import annotations

from collections.abc import Iterable

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ROSClock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rclpy.time_source import CLOCK_TOPIC, USE_SIM_TIME_NAME
from rosgraph_msgs.msg import Clock as ClockMessage

from .context import Context
from .publisher import TolerantPublisher

_PERIOD = 1.0  # s, from one check for other publishers to the next


def check_clock(node: Node, publish: bool) -> None:
    """Raise ValueError if the node is to publish the clock that it follows."""
    if publish and node.get_parameter(USE_SIM_TIME_NAME).value is True:
        raise ValueError(
            'clock.publish and use_sim_time are both true, but the node cannot follow the clock '
            'that it publishes; write clock.publish: false to follow another /clock, or '
            'use_sim_time: false to be the clock'
        )


class SimulationClock:
    """
    Publish the simulated time, and set the clock of the node to it.

    Parameters
    ----------
    context
        Of the node.
    steady
        Clock of the checks, which does not stand still.

    """

    def __init__(self, context: Context, steady: Clock) -> None:
        self._node, self._live = context.node, context.live
        self._transforms = context.transforms
        self._publisher = TolerantPublisher(context, ClockMessage, CLOCK_TOPIC)
        self.topic = self._publisher.topic
        self._next = 0.0
        self._others = 0
        self._time = 0
        clock = self._node.get_clock()
        assert isinstance(clock, ROSClock)
        self._clock = clock
        with self._clock.handle:
            self._clock.handle.set_ros_time_override_is_enabled(True)
        self._node.add_on_set_parameters_callback(_refuse_to_follow)
        self._node.create_timer(_PERIOD, self._check_others, clock=steady)

    def show(self) -> int:
        """Set the clock of the node to the simulated time; return that, ns."""
        time, self._time = self._time, round(1e9 * self._live.time)
        if self._time < time:  # after a reset, say
            self._transforms.discard()
        now = Time(nanoseconds=self._time, clock_type=ClockType.ROS_TIME)
        self._clock.set_ros_time_override(now)
        return self._time

    def publish(self) -> None:
        """Publish the time."""
        message = ClockMessage()
        message.clock.sec, message.clock.nanosec = divmod(self._time, 10**9)
        self._publisher.publish(message)

    def publish_if_due(self, now: float) -> None:
        """Publish the time at `clock.rate`; `now` is the time of the tick, s."""
        scene = self._live.scene
        rate = scene.clock.rate or scene.rate
        # Half a tick of tolerance: a tick that is early by its jitter is the one that was meant.
        if now >= self._next - 0.5 / scene.rate:
            self._next = max(self._next + 1 / rate, now)
            self.publish()

    def _check_others(self) -> None:
        """Warn of other publishers on /clock."""
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        own = (self._node.get_name(), self._node.get_namespace())
        names = [(each.node_name, each.node_namespace) for each in publishers]
        others = [f'{space.rstrip("/")}/{name}' for name, space in names if (name, space) != own]
        others += ['another node of this name'] * max(names.count(own) - 1, 0)
        if len(others) > self._others:
            self._node.get_logger().warning(
                f'{self.topic} is published by {" and ".join(others)} too: the time of nodes with '
                'use_sim_time jumps; end one, or start this node with -p clock.publish:=false'
            )
        self._others = len(others)


def _refuse_to_follow(parameters: Iterable[Parameter]) -> SetParametersResult:
    for parameter in parameters:
        if parameter.name == USE_SIM_TIME_NAME and parameter.value is True:
            reason = (
                'use_sim_time is True, but must be False while this node publishes /clock; start '
                'the node with -p clock.publish:=false'
            )
            return SetParametersResult(successful=False, reason=reason)
    return SetParametersResult(successful=True)
