"""The topic `/diagnostics`: state and measured values of the node, once a second."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Header

from ..messages.diagnostics import diagnostics_message
from .context import Context
from .publisher import TolerantPublisher
from .rejected_inputs import THROTTLE
from .status import evaluate
from .tick_clock import TickClock
from .tick_statistics import TickStatistics

PERIOD = 1.0  # s


class Diagnostics:
    """
    Evaluate, log and publish the state of the node once a second.

    Parameters
    ----------
    context
        Of the node.
    clock, ticks
        Clock and statistics of the ticks.

    """

    def __init__(self, context: Context, clock: TickClock, ticks: TickStatistics) -> None:
        self._context, self._clock, self._ticks = context, clock, ticks
        self._publisher = TolerantPublisher(context, DiagnosticArray, '/diagnostics')
        self.topic = self._publisher.topic

    @property
    def wanted(self) -> bool:
        """True if there is a subscriber."""
        return self._publisher.wanted

    def report(self) -> None:
        """Evaluate what has happened since the last call, and publish it if anyone subscribes."""
        context, live = self._context, self._context.live
        report = live.take_report()
        status = evaluate(
            report, self._ticks, self._clock, paused=live.paused, frames=context.frames.problem
        )
        times = self._ticks.take_report(self._clock.period)
        node = context.node
        if status.logged:
            node.get_logger().warning(status.message, **THROTTLE)
        if not self.wanted:
            return
        values = {
            'real-time factor': status.real_time_factor,
            'waited for a processor [s]': report.waiting,
            **live.values(),
            **times,
            **context.frames.values(),
            **context.rejected.report(),
            'messages not sent': context.unsent.total(),
        }
        header = Header(stamp=node.get_clock().now().to_msg())
        name = node.get_fully_qualified_name()
        self._publisher.publish(
            diagnostics_message(header, name, status.message, values, status.level)
        )
