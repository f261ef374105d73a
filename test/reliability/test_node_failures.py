"""Failures inside a live node, and clocks that it starts with."""

import sys
from itertools import count, repeat

from builtin_interfaces.msg import Time
from ros import diagnosis, publish_until
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2

NOT_SENT = """
import sys
from itertools import count
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.publisher import Publisher
from cloth_ros.node.main import main

publish, tries = Publisher.publish, count()

def failing(self, message):
    if 'cloth' in self.topic_name and next(tries) < 10:
        raise rclpy_implementation.RCLError('failed to publish: a time-out')
    publish(self, message)

Publisher.publish = failing
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
    publish_until(lambda: 'rejected a message on clock' in node.output, probe, clock,
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
