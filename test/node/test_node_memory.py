"""How much memory a node takes is known before it is taken."""

from pathlib import Path

import pytest
from builders import scene_of
from diagnostic_msgs.msg import DiagnosticArray
from ros import diagnosis
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from cloth_ros.model import memory

TOPICS = {
    '/cloth/particles': PointCloud2,
    '/cloth/markers': MarkerArray,
    '/diagnostics': DiagnosticArray,
}


@pytest.mark.slow
def test_the_peak_of_a_node_is_at_most_what_is_foreseen_and_not_much_less(start_cloth, probe):
    """With all that it publishes subscribed to."""
    peaks = []
    for size in (8, 256):
        node = start_cloth(sheet__rows=size, sheet__columns=size, solver__tolerance=1.0)
        received = {topic: [] for topic in TOPICS}
        subscriptions = [
            probe.create_subscription(kind, topic, received[topic].append, 5, raw=True)
            for topic, kind in TOPICS.items()
        ]
        probe.spin_until(lambda: min(map(len, received.values())) >= 3)  # noqa: B023
        # The finer solution of the error estimate takes memory too, once it is made.
        probe.spin_until(lambda: 'sampled' not in diagnosis(probe)['error estimate [m]'])
        status = Path(f'/proc/{node.process.pid}/status').read_text()
        peaks.append(1024 * int(status.split('VmHWM:')[1].split()[0]))
        for subscription in subscriptions:
            probe.destroy_subscription(subscription)
        node.stop()
    foreseen = memory.of_node(scene_of(sheet__rows=256, sheet__columns=256))
    # How many copies of the messages there are at once depends on the load of the machine.
    assert 0.3 < (peaks[1] - peaks[0]) / foreseen < 1.1
