"""The node `cloth`: a live cloth on the ROS graph."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger

from ..interrupt import Stop
from ..live.coarse_cloth import cloth_on, take_over
from ..live.error_estimate import ErrorEstimator
from ..live.kernel_compiler import Background, compile_for
from ..live.overload import Level, Overload
from ..live.pacing import Pacing
from ..live.solver_summary import solution
from ..messages.diagnostics import diagnostics_message
from ..model import Cloth
from ..model.energy_monitor import RollbackCounts
from ..model.time_step import integrator_for
from ..scene import Scene
from ..scene.parameter import format_error
from .clock_jump_watchdog import watch_for_clock_jumps
from .duplicate_names import DuplicateNames
from .parameters import SafeParameterService, changed_scene, coerce_types, declare_scene
from .publishers import Output, StatePublisher
from .qos import overridable_qos
from .rejected_inputs import THROTTLE, RejectedInputs
from .tick_clock import Tick, TickClock
from .tick_statistics import TickStatistics
from .transforms import Transforms
from .validated_clock import ValidatedClockNode

_OVERDUE = 2  # periods without a tick that are too many
_LONGEST_PAUSE = 1.0  # s, of which there is a share for the error estimate
_ESTIMATING = 0.045  # share of a core for the error estimate; its bookkeeping makes it 5 %
# To wait for kernels before the cloth goes on without them, s: with a tick, no time is lost.
_AT_ONCE = 0.03


class ClothNode(ValidatedClockNode):
    """Steps a cloth by the clock, publishes it, and takes wind, sphere and parameters."""

    def __init__(self, stop: Stop) -> None:
        super().__init__(
            'cloth',
            automatically_declare_parameters_from_overrides=True,
            start_parameter_services=False,
        )
        scene, self._queues = declare_scene(self)
        self._parameter_service = SafeParameterService(
            self, self._check, lambda: self._rejections.count('parameters')
        )
        self._log = self.get_logger()
        self._rejections = RejectedInputs(self._log)
        self._log.info('kernels that were never compiled on this machine take some seconds each')
        self._stop = stop
        self._cloth = Cloth(scene)
        for kernel in self._cloth.warm_up():
            self._log.info(f'preparing the kernels of {kernel}')
        self._pacing = Pacing()
        self._pacing.expect(self._cloth.compile())
        self._overload = Overload(scene)
        self._spacing = 1
        self._monitor = ErrorEstimator(self._cloth, background=True)
        self._asked = scene
        self._coming: Background[None] | None = None
        self._coming_level: Background[None] | None = None
        self._next = scene
        self._not_made: Scene | None = None
        self._may_adopt = True
        self._unsaid = False
        self._paused = False
        self._ticking = TickClock(self, self._tick)
        self._rollbacks = RollbackCounts()
        self._ticks, self._jumps, self._jump = 0, 0, 0.0
        self._times = TickStatistics()
        self._frames = Transforms(self, scene.frame_id)

        self._states = StatePublisher(self, scene)
        self._diagnostics = Output(self, DiagnosticArray, '/diagnostics')
        self.create_subscription(Vector3Stamped, 'wind', self._on_wind, **overridable_qos())
        self.create_subscription(
            PoseStamped, 'sphere_pose', self._on_sphere_pose, **overridable_qos()
        )
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.create_service(SetBool, '~/pause', self._on_pause)
        self.add_pre_set_parameters_callback(coerce_types)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

        steady = self._ticking.steady
        reports = self.create_timer(1.0, self._publish_diagnostics, clock=steady)
        watch_for_clock_jumps(reports)
        DuplicateNames(self, steady)
        self._start_ticking()
        self._greet()

    def _greet(self) -> None:
        scene = self._cloth.scene
        sheet = scene.sheet
        self._log.info(
            f'{sheet.rows} × {sheet.columns} particles at {scene.rate:g} Hz: {self._solver_summary()}'
        )
        self._log.info(
            f'publishing {self._states.particles.topic}, {self._states.markers.topic} and '
            f'{self._diagnostics.topic}; listening to '
            f'{self.resolve_topic_name("wind")} and {self.resolve_topic_name("sphere_pose")}'
        )

    # The clock

    def _start_ticking(self) -> None:
        if self._ticking.start(self._cloth.scene.rate):
            self._stamp = self.get_clock().now().nanoseconds
            self._states.restart_clock()

    def _tick(self) -> None:
        self._may_adopt = True
        self._follow_parameters()
        self._follow_overload()
        self._start_ticking()  # anew if the rate has changed
        tick, stamp = self._ticking.tick(), self.get_clock().now().nanoseconds
        self._ticks += 1
        if tick.jump is not None:
            self._jumps, self._jump = self._jumps + 1, tick.jump
            self._states.restart_clock()
            if tick.jump < 0:
                self._frames.forget()
        if self._paused:
            self._pacing.forget()
        else:
            self._simulate(tick)
            if self._stop.asked:  # in the middle of a step: there is no state to publish
                return
            # The state is as old as what is pending.
            self._stamp = max(stamp - int(self._pacing.pending * 1e9), 0)
        start = time.perf_counter()
        self._states.publish(self._cloth, tick.now, self._stamp)
        if tick.jump is None:
            self._times.add(tick.elapsed, time.perf_counter() - start)
        if self._estimating and not self._paused:
            # A share of a core is one of wall-clock time, whatever clock the ticks follow.
            self._monitor.work(_ESTIMATING * min(tick.wall, _LONGEST_PAUSE))

    @property
    def _estimating(self) -> bool:
        """True if someone listens to the error estimate, or there is none yet, but could be."""
        wanted = self._diagnostics.wanted or self._monitor.estimate is None
        return self._spacing == 1 and wanted

    def _simulate(self, tick: Tick) -> None:
        scene, cloth, pacing = self._cloth.scene, self._cloth, self._pacing
        substep = cloth.substep
        lost = pacing.lost
        period = self._ticking.period
        wall = tick.wall if self._ticking.simulated else period
        count = pacing.due(tick.elapsed, substep, period, scene.solver.max_tick, wall)
        if count == 0:
            return
        start = time.perf_counter()
        if self._estimating:
            self._monitor.observe(count * substep)
        for _ in cloth.advance_stepwise(count * substep):
            if self._stop.asked:
                return
        pacing.done(count, substep, time.perf_counter() - start)
        if pacing.lost > lost:
            self._change_level(self._overload.relax)

    def _change_level(self, change: Callable[[float], bool]) -> None:
        """Have the overload choose what the machine can follow, by the cost of a substep, s."""
        if self._coming_level is None and change(self._pacing.cost):
            level = self._overload.level
            self._coming_level = Background(lambda: compile_for(level.scene, level.spacing))
            self._coming_level.wait(_AT_ONCE)

    def _follow_overload(self) -> None:
        """Go on with what the overload has chosen, once its kernels are there."""
        if self._coming_level is None or not self._coming_level.done:
            return
        error, self._coming_level = self._coming_level.error, None
        level = self._overload.level
        if error is not None:
            self._log.error(f'overload, {level.text}: cannot be compiled, {format_error(error)}')
            return
        self._go_on_with(level)
        self._log.warning(f'overload, {level.text}: {self._solver_summary()}')

    def _go_on_with(self, level: Level) -> None:
        """Simulate what a level says from here on."""
        if level.spacing == self._spacing == 1:
            self._cloth.configure(level.scene)
        else:
            before, self._cloth = self._cloth, cloth_on(level.scene, level.spacing)
            take_over(self._cloth, before)
        self._spacing = level.spacing
        self._pacing.expect(self._cloth.compile())
        self._monitor.restart(self._cloth)

    def _solver_summary(self) -> str:
        return solution(self._cloth, self._pacing.load(self._cloth.substep))

    # Inputs

    def reject(self, topic: str, reason: object) -> None:
        """Note that a message was refused."""
        self._rejections.add(topic, reason)

    def _on_wind(self, message: Vector3Stamped) -> None:
        self._follow_parameters()
        vector = (message.vector.x, message.vector.y, message.vector.z)
        try:
            self._cloth.wind = self._frames.to_own(vector, message.header.frame_id, is_point=False)
            if not self._cloth.scene.has_air:
                self._log.warning(
                    'there is wind, but no air that acts: set wind.air_density above 0, and give '
                    'the sheet two rows and two columns',
                    **THROTTLE,
                )
        except ValueError as error:
            self.reject('wind', error)

    def _on_sphere_pose(self, message: PoseStamped) -> None:
        self._follow_parameters()
        position = message.pose.position
        try:
            point = (position.x, position.y, position.z)
            self._cloth.move_sphere(
                self._frames.to_own(point, message.header.frame_id, is_point=True)
            )
        except ValueError as error:
            self.reject('sphere_pose', error)

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._follow_parameters()
        self._cloth.reset()
        self._monitor.restart()
        self._pacing.forget()
        self._stamp = self.get_clock().now().nanoseconds
        response.success = True
        response.message = 'the cloth is back in its initial state'
        return response

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._paused = request.data
        response.success = True
        response.message = 'paused' if self._paused else 'running'
        return response

    # Parameters

    def _check_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            self._check(parameters)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _check(self, parameters: list[Parameter]) -> None:
        changed_scene(self._asked, parameters, self._queues)

    def _apply_parameters(self, parameters: list[Parameter]) -> None:
        self._asked = changed_scene(self._asked, parameters, self._queues)
        if self._may_adopt:
            self._follow_parameters()
        if any(parameter.name == 'use_sim_time' for parameter in parameters):
            self._start_ticking()

    def _follow_parameters(self) -> None:
        """
        Go on with the scene that was asked for, once its kernels are there.

        However often parameters change, they do so once a tick, unless an input comes between.
        """
        changed = self._asked is not self._overload.asked and self._asked is not self._not_made
        if self._coming is None and changed:
            scene = self._asked
            self._coming = Background(lambda: compile_for(scene))
            if not self._coming.wait(_AT_ONCE):
                self._log.info('compiling kernels for what has changed; until then all goes on')
            self._next = scene
        if self._coming is not None and self._coming.done:
            error, self._coming = self._coming.error, None
            if error is None:
                self._adopt(self._next)
            else:
                # The same would fail at each tick.
                self._not_made = self._next
                self._log.error(
                    f'the kernels for what has changed cannot be compiled ({format_error(error)}): '
                    'the cloth stays as it was, and parameters say what was asked for; set one '
                    'to try all of them again'
                )

    def _adopt(self, scene: Scene) -> None:
        self._may_adopt = False
        self._overload, self._coming_level = Overload(scene), None
        self._go_on_with(self._overload.level)
        self._states.change_scene()
        self._unsaid = True

    # Diagnostics

    def _publish_diagnostics(self) -> None:
        cloth = self._cloth
        if self._unsaid:
            self._unsaid = False
            self._log.info(self._solver_summary())
        factor, lost = self._pacing.take_report()
        times = self._times.take_report(self._ticking.period)
        # Ticks as slow as reports, or slower, may come before and after one.
        overdue = self._ticks == 0 and self._ticking.quiet > _OVERDUE / cloth.scene.rate
        jumping = 0 < self._ticks == self._jumps
        factor *= not (self._paused or overdue or jumping)
        level = DiagnosticStatus.WARN
        repeated = cloth.rollbacks.since(self._rollbacks).text
        self._rollbacks = replace(cloth.rollbacks)
        if self._paused:
            message, level = 'paused', DiagnosticStatus.OK
        elif repeated:
            message = f'energy from nowhere: repeated stretches of substeps, {repeated}'
            self._log.warning(message, **THROTTLE)
        elif overdue:
            why = 'is there a /clock?' if self._ticking.simulated else 'the machine is busy'
            message = f'no tick since the last report; {why}'
        elif self._ticks == 0 and factor == 0:
            message, level = 'no tick was due yet', DiagnosticStatus.OK
        elif jumping:
            message = f'/clock moves by {self._jump:.4g} s at once: none of it is simulated'
        elif lost > 0:
            message = f'overload: slow motion, {lost:.3g} s lost since the last report'
            self._log.warning(message, **THROTTLE)
        elif self._overload.depth:
            message = f'overload: {self._overload.level.text}'
        else:
            message, level = 'running in real time', DiagnosticStatus.OK
        self._ticks = self._jumps = 0
        if lost == 0:
            self._change_level(self._overload.recover)
        if not self._diagnostics.wanted:
            return
        values = {
            'real-time factor': factor,
            'simulated time [s]': cloth.time,
            'substeps in the last tick': cloth.substeps,
            'method': integrator_for(cloth.scene).name,
            'tolerance [m]': cloth.scene.solver.tolerance,
            'step [s]': cloth.substep,
            'stability limit [s]': cloth.stability_limit,
            'load [share of real time]': self._pacing.load(cloth.substep),
            **times,
            'energy [J]': cloth.energy(),
            'largest strain': cloth.largest_strain(),
            **self._monitor.report(),
            'sphere radius [m]': cloth.sphere_radius,
            'sphere depth [m]': cloth.sphere_depth,
            **self._rejections.report(),
            'messages not sent': self._states.unsent + self._diagnostics.unsent,
            **{f'stretches {how}': count for how, count in vars(cloth.rollbacks).items()},
        }
        header = Header(stamp=self.get_clock().now().to_msg())
        name = self.get_fully_qualified_name()
        self._diagnostics.publish(diagnostics_message(header, name, message, values, level))
