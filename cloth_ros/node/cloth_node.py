"""The node `cloth`: a live cloth on the ROS graph."""

from __future__ import annotations

import time

from rclpy.time_source import CLOCK_TOPIC

from ..interrupt import StopSignal
from ..live.live_cloth import LiveCloth
from ..scene import Scene
from .body_frames import BodyFrames
from .clock_jump_watchdog import watch_for_clock_jumps
from .context import Context
from .diagnostics import PERIOD, Diagnostics
from .duplicate_names import DuplicateNames
from .inputs import INPUTS
from .outputs import OUTPUTS
from .parameter_services import SafeParameterService
from .parameters import SceneParameters, declare_scene
from .rejected_inputs import RejectedInputs
from .services import SERVICES
from .services.grasp import GraspServices
from .simulation_clock import SimulationClock, check_clock
from .state_stamps import StateStamps
from .tick_clock import TickClock
from .tick_statistics import TickStatistics
from .transforms import Transforms
from .validated_clock import ValidatedClockNode


class ClothNode(ValidatedClockNode):
    """
    Connect a `LiveCloth` to topics, services, parameters and a clock.

    Parameters
    ----------
    stop
        Asked between substeps whether to stop.

    Raises
    ------
    ValueError
        The parameters do not make a scene that can be simulated.

    """

    def __init__(self, stop: StopSignal) -> None:
        super().__init__(
            'cloth',
            automatically_declare_parameters_from_overrides=True,
            start_parameter_services=False,
        )
        self._stop = stop
        self._log = self.get_logger()
        self._rejected = RejectedInputs(self._log)
        scene, queues = declare_scene(self)
        check_clock(self, scene.clock.publish)
        self._log.info('preparing the kernels')
        self._transforms = Transforms(self, scene.frame_id)
        self._frames = BodyFrames(self._transforms, self._log)
        self._scene = scene
        now = self.get_clock().now().nanoseconds
        self._live = LiveCloth(self._frames.simulated(scene, None, now), self._log)
        parameters = SceneParameters(self, scene, queues, self._apply)
        context = Context(
            self,
            self._live,
            self._transforms,
            self._rejected,
            self._frames,
            parameters,
            self._step,
        )
        self._sender = context.sender
        self._outputs = [make(context) for make in OUTPUTS]
        self._inputs = [make(context) for make in INPUTS]
        self._grasps = GraspServices(context)
        self._grasps.follow(scene)
        for each in self._inputs:
            each.follow(scene)
        for create in SERVICES:
            create(context)
        self._rejected.register(CLOCK_TOPIC)

        self._tick_clock = TickClock(self, self._tick)
        self._simulation_clock: SimulationClock | None = None
        if scene.clock.publish:
            self._simulation_clock = SimulationClock(context, self._tick_clock.steady)
        self._ticks = TickStatistics()
        self._diagnostics = Diagnostics(context, self._tick_clock, self._ticks)
        parameters.follow()
        self._safe_service = SafeParameterService(self, parameters, self._rejected.count_request)
        timer = self.create_timer(PERIOD, self._report, clock=self._tick_clock.steady)
        watch_for_clock_jumps(timer)
        DuplicateNames(self, self._tick_clock.steady)
        self._stamps, self._revision = StateStamps(), -1
        self._announced = False
        self._follow_clock()
        self._announce()

    def destroy_node(self) -> None:
        """End what runs in the background, and the node."""
        self._live.close()
        self._sender.close()
        super().destroy_node()

    def reject(self, topic: str, reason: object) -> None:
        """Record that a message was rejected."""
        self._rejected.add(topic, reason)

    def clock_moved(self) -> None:
        """Tick, if it is time to."""
        self._tick_clock.clock_moved()

    def _announce(self) -> None:
        """Log what is simulated and published, once that begins."""
        if self._announced or not self._live.running:
            return
        self._announced = True
        scene = self._live.scene
        self._log.info(
            f'{scene.sheet.rows} × {scene.sheet.columns} particles at {scene.rate:g} Hz: '
            f'{self._live.solver_summary}'
        )
        inputs = [topic for each in self._inputs for topic in each.topics]
        outputs = [topic for each in self._outputs for topic in each.topics]
        outputs.append(self._diagnostics.topic)
        if self._simulation_clock is not None:
            outputs.append(self._simulation_clock.topic)
        self._log.info(
            f'publishing {", ".join(outputs[:-1])} and {outputs[-1]}; listening to '
            f'{", ".join(inputs[:-1])} and {inputs[-1]}'
        )

    def _apply(self, scene: Scene) -> None:
        """Go on with the parameters that were set."""
        if scene is not self._scene:
            former, self._scene = self._scene, scene
            now = self.get_clock().now().nanoseconds
            simulated = self._frames.simulated(scene, self._live, now)
            groups = zip(scene.named_groups, former.named_groups, strict=True)
            prepared = any(now.unnamed != before.unnamed for now, before in groups)
            # Parameters of a body that is not named change nothing that is simulated.
            if not prepared or simulated != self._live.requested:
                self._live.configure(simulated)
            self._grasps.follow(scene)
            for each in self._inputs:
                each.follow(scene)
        self._follow_clock()

    def _follow_clock(self) -> None:
        """Tick at the rate of the scene, by the clock that `use_sim_time` selects."""
        if self._tick_clock.start(self._live.scene.rate):
            self._stamps.restart(self.get_clock().now().nanoseconds)

    def _tick(self) -> None:
        self._free_sender()
        tick, stamp = self._tick_clock.tick(), self.get_clock().now().nanoseconds
        self._ticks.begin(tick)
        if tick.jump is not None and tick.jump < 0:
            self._transforms.discard()
        if not self._live.paused:
            self._frames.move(self._live, stamp)
        period = self._tick_clock.period
        complete = self._live.tick(
            tick.elapsed,
            period=period,
            wall=tick.wall if self._tick_clock.simulated else period,
            estimate_error=self._diagnostics.wanted,
            interrupted=lambda: self._stop.requested,
        )
        if not complete:  # there is no state to publish
            return
        moved = self._live.revision != self._revision or tick.jump is not None
        if moved:
            self._revision = self._live.revision
            self._stamps.tick(stamp, self._live.pending, jumped=tick.jump is not None)
        start = time.perf_counter()
        if self._simulation_clock is not None:
            self._stamps.restart(self._simulation_clock.show())
            self._simulation_clock.publish_if_due(tick.now)
        # Less than half a substep may have passed: that state was published with its stamp.
        if moved or self._live.paused:
            self._publish(tick.now)
        self._ticks.end(tick, time.perf_counter() - start)
        self._live.estimate_error(tick.wall)
        self._announce()
        self._follow_clock()  # the rate may have changed

    def _publish(self, now: float) -> None:
        """Publish the present state; `now` is the time of the clock that ticks follow, s."""
        for output in self._outputs:
            output.publish(now, self._stamps.stamp)

    def _step(self) -> None:
        """Simulate one tick while the cloth is paused, and publish it; raises ValueError."""
        self._frames.move(self._live, self.get_clock().now().nanoseconds)
        if not self._live.step(interrupted=lambda: self._stop.requested):
            return
        self._revision = self._live.revision
        self._stamps.step(1 / self._live.scene.rate)
        if self._simulation_clock is not None:
            self._stamps.restart(self._simulation_clock.show())
            self._simulation_clock.publish()
        self._publish(self._tick_clock.now)

    def _free_sender(self) -> None:
        """Do not wait for a subscriber that hangs."""
        for thread in self._sender.free():
            self._log.warning(
                f'thread {thread} is stopped or dead and held a lock in shared memory, which was '
                'released: other subscribers would have waited for it'
            )

    def _report(self) -> None:
        self._live.poll()  # without /clock there are no ticks
        self._announce()
        self._diagnostics.report()
