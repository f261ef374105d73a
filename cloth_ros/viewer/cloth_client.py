"""Everything that is exchanged with one cloth: topics, services and parameters."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger

from .collider_poses import ECHO, ColliderPoses
from .discovery import ClothName
from .grippers import GripperClients
from .marker_shapes import MarkerShapes, Shapes
from .node_parameters import NodeParameters
from .particles import Sheet, decode
from .pose import Vector

# The newest state only, and no acknowledgements: a slow viewer must not delay the node.
_NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_SILENT_AFTER = 2.0  # s without particles
MAX_WIND = 50.0  # m/s, that the page may command
# Parameters that change what the markers show.
_DRAWN = ('pins', 'sphere.radius', 'sphere.position', 'collider.', 'gripper.', 'markers.')


class ClothClient:
    """
    One cloth as the viewer knows it.

    All methods are called in the thread that spins the node.

    Parameters
    ----------
    node
        Owner of subscriptions, publishers and clients.
    name
        Of the cloth.
    report
        Called with a text for the user.

    Attributes
    ----------
    sheet
        Newest state that was taken; None before the first one.
    shapes, shapes_revision
        Pins, colliders and grippers, and the number of times they were read.
    poses
        Present poses of the colliders and grippers.
    grippers
        Services of the grippers.
    values, level, message
        Of the newest diagnostics: numbers as text by key.
    reports
        Number of diagnostics received.

    """

    def __init__(self, node: Node, name: ClothName, report: Callable[[str], None]) -> None:
        self.name = name
        self.sheet: Sheet | None = None
        self.shapes: Shapes | None = None
        self.shapes_revision = 0
        self._commanded_wind: Vector | None = None
        self.values: dict[str, str] = {}
        self.level, self.message, self.reports = b'\0', '', 0
        self.problem = ''  # why particles cannot be shown
        self._node, self._report = node, report
        self._raw: bytes | None = None
        self._arrivals: deque[float] = deque(maxlen=60)
        self._first_arrival = math.inf
        self._wind_sent = -ECHO
        self._had_publisher = True
        topic, subscribe = name.resolve, node.create_subscription
        subscribe(PointCloud2, topic('~/particles'), self._on_particles, _NEWEST, raw=True)
        subscribe(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        subscribe(ParameterEvent, '/parameter_events', self._on_parameter_event, 100)
        subscribe(Vector3Stamped, topic('wind'), self._on_wind, 5)
        self._wind = node.create_publisher(Vector3Stamped, topic('wind'), 5)
        self._pause = node.create_client(SetBool, topic('~/pause'))
        self._reset = node.create_client(Trigger, topic('~/reset'))
        self._step = node.create_client(Trigger, topic('~/step'))
        self.parameters = NodeParameters(node, name.node, report)
        self.poses = ColliderPoses(node, name)
        self.grippers = GripperClients(node, name, report)
        self._markers = MarkerShapes(node, topic('~/markers'))
        self._markers.request()

    # What is received

    def _on_particles(self, message: bytes) -> None:
        self._raw = message
        self._first_arrival = min(self._first_arrival, time.monotonic())
        self._arrivals.append(time.monotonic())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.partition(':')[0] != self.name.node:
                continue
            before = self.number('simulated time [s]')
            self.values = {each.key: each.value for each in status.values}
            self.level, self.message = status.level, status.message
            self.reports += 1
            self.grippers.take(self.values)
            if self.number('simulated time [s]') < before:
                self._has_begun_again()

    def _on_parameter_event(self, event: ParameterEvent) -> None:
        if event.node == self.name.node:
            self.parameters.follow(event)
            changed = (*event.new_parameters, *event.changed_parameters, *event.deleted_parameters)
            if any(each.name.startswith(_DRAWN) for each in changed):
                self._markers.request()
            if any(each.name == 'wind.velocity' for each in changed):
                self._commanded_wind = None

    def _on_wind(self, message: Vector3Stamped) -> None:
        velocity = message.vector.x, message.vector.y, message.vector.z
        own = time.monotonic() < self._wind_sent + ECHO
        foreign = message.header.frame_id not in ('', self.poses.frame_id)
        if all(map(math.isfinite, velocity)) and not own and not foreign:
            self._commanded_wind = velocity

    def _has_begun_again(self) -> None:
        """Read everything again: the cloth was reset, or its node was started again."""
        self.parameters.refresh()
        self._markers.request()
        self._commanded_wind = None

    # State

    def number(self, key: str) -> float:
        """Return a value of the newest diagnostics; NaN if it is no number."""
        try:
            return float(self.values.get(key, 'nan'))
        except ValueError:
            return math.nan

    @property
    def wind(self) -> Vector:
        """Wind that anyone has commanded last, m/s; until then that of the scene."""
        if self._commanded_wind is not None:
            return self._commanded_wind
        x, y, z = self.parameters.values.get('wind.velocity', (0.0, 0.0, 0.0))
        return float(x), float(y), float(z)

    @property
    def spacing(self) -> tuple[float, float] | None:
        """Lengths at rest along a row and along a column, m; None if they are not known."""
        values = self.parameters.values
        size, shape = values.get('sheet.size'), self.sheet and self.sheet.shape
        if not size or shape != (values.get('sheet.rows'), values.get('sheet.columns')):
            return None
        rows, columns = shape
        return size[0] / max(columns - 1, 1), size[1] / max(rows - 1, 1)

    @property
    def has_publisher(self) -> bool:
        """True while somebody publishes the particles."""
        return bool(self._node.count_publishers(self.name.resolve('~/particles')))

    @property
    def is_live(self) -> bool:
        """True while particles come."""
        return bool(self._arrivals) and time.monotonic() < self._arrivals[-1] + _SILENT_AFTER

    @property
    def is_known(self) -> bool:
        """True once pins and colliders are known, or the first particles came some time ago."""
        waited = time.monotonic() - self._first_arrival
        return self.shapes is not None or waited > _SILENT_AFTER

    @property
    def paused(self) -> bool:
        """True if the node reports that it is paused."""
        return self.message == 'paused'

    @property
    def can_step(self) -> bool:
        """True if the node offers a service that makes one tick."""
        return bool(self._step.service_is_ready())

    @property
    def can_be_commanded(self) -> bool:
        """True if the node offers its services; a recording does not."""
        return bool(self._reset.service_is_ready()) and self.parameters.available

    @property
    def rate(self) -> float:
        """Messages of particles per second."""
        times = self._arrivals
        if not self.is_live or len(times) < 2 or times[-1] <= times[0]:
            return 0.0
        return (len(times) - 1) / (times[-1] - times[0])

    # Called regularly

    def update(self) -> None:
        """Send requests that are due, take pins and colliders; some times a second."""
        has_publisher = self.has_publisher
        if has_publisher and not self._had_publisher:
            self._has_begun_again()
        self._had_publisher = has_publisher
        self.parameters.update(time.monotonic())
        names = self.parameters.values.get('gripper.names', ())
        self.grippers.follow([each for each in names if each])
        shapes = self._markers.take()
        if shapes is not None:
            self.shapes = shapes
            self.shapes_revision += 1
            self.poses.follow({name: pose for name, (pose, _) in shapes.colliders.items()})

    def take_sheet(self) -> Sheet | None:
        """Return the newest state if it was not returned before."""
        if self._raw is None:
            return None
        raw, self._raw = self._raw, None
        try:
            self.sheet = decode(deserialize_message(raw, PointCloud2), self.sheet)
        except ValueError as error:
            self.problem = str(error)
            return None
        self.problem = ''
        self.poses.frame_id = self.sheet.frame_id
        return self.sheet

    # Commands

    def set_wind(self, velocity: Vector) -> None:
        """Publish the velocity of the air, m/s."""
        self._commanded_wind, self._wind_sent = velocity, time.monotonic()
        message = Vector3Stamped()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.vector.x, message.vector.y, message.vector.z = velocity
        self._wind.publish(message)

    def pause(self, paused: bool) -> None:
        """Stop or continue the simulated time."""
        if self._pause.service_is_ready():
            self._pause.call_async(SetBool.Request(data=paused))
            self.message = 'paused' if paused else 'running'

    def reset(self) -> None:
        """Return to the initial state."""
        if self._reset.service_is_ready():
            future = self._reset.call_async(Trigger.Request())
            future.add_done_callback(lambda _: self._has_begun_again())

    def step(self) -> None:
        """Make one tick of a paused cloth."""
        if self._step.service_is_ready():
            self._step.call_async(Trigger.Request())
