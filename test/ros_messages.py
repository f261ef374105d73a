"""What the tests of the node send and read."""

from collections.abc import Iterator

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.msg import SetParametersResult
from sensor_msgs.msg import PointCloud2

# A sheet that stays as it is until something acts on it.
FLOATING = {
    'sheet__rows': 9,
    'sheet__columns': 9,
    'gravity': '[0.0, 0.0, 0.0]',
    'drag': 0.0,
    'solver__precision': 'double',
}
SPHERE = {'sphere__radius': 0.1, 'sphere__position': '[0.0, 0.0, 2.0]'}


def stamp(message) -> float:
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def regular(stamps: list[float], period: float) -> bool:
    """Tell if the newest stamps keep a period; on a busy machine that may take a while."""
    newest = stamps[-30:]
    return len(newest) == 30 and abs(np.median(np.diff(newest)) - period) < 0.05 * period


def numbers(cloud: PointCloud2) -> np.ndarray:
    return np.frombuffer(cloud.data, np.float32).reshape(cloud.height, cloud.width, 6)


def wind(x=0.0, y=0.0, z=0.0, frame='') -> Vector3Stamped:
    message = Vector3Stamped()
    message.header.frame_id = frame
    message.vector.x, message.vector.y, message.vector.z = x, y, z
    return message


def pose(x=0.0, y=0.0, z=0.0, frame='') -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y, message.pose.position.z = x, y, z
    return message


def set_parameters(probe, **values) -> list[SetParametersResult]:
    named = {name.replace('__', '.'): value for name, value in values.items()}
    return probe.set_parameters_of_cloth(named)


def publish_until(condition, probe, publisher, messages: Iterator) -> None:
    """Publish one message after another: a busy node keeps but the newest, and may miss that."""

    def done() -> object:
        publisher.publish(next(messages))
        return condition()

    probe.spin_until(done)


def diagnosis(probe) -> dict[str, str]:
    """The next diagnostics, as a mapping; the message under 'message', the level under 'level'."""
    messages = probe.collect(DiagnosticArray, '/diagnostics')
    probe.spin_until(lambda: messages)
    status = messages[0].status[0]
    return {
        'name': status.name,
        'message': status.message,
        'level': status.level,
        **{item.key: item.value for item in status.values},
    }
