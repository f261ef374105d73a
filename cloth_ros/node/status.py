"""State of the node in one sentence, and whether it needs attention."""

from __future__ import annotations

from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticStatus

from ..live.report import Report
from .tick_clock import TickClock
from .tick_statistics import TickStatistics

_OVERDUE = 2  # periods without a tick that are too many


class Status(NamedTuple):
    """
    State of the node.

    Attributes
    ----------
    message
        One sentence.
    level
        OK or WARN of DiagnosticStatus.
    real_time_factor
        Simulated time by time passed; 0 while nothing is simulated.
    logged
        True if the message is to be logged as a warning as well.

    """

    message: str
    level: bytes
    real_time_factor: float
    logged: bool = False


def evaluate(
    report: Report, ticks: TickStatistics, clock: TickClock, *, paused: bool, frames: str = ''
) -> Status:
    """
    Return the state of the node.

    Parameters
    ----------
    report
        How the cloth has run since the report before.
    ticks, clock
        The ticks since then, and the clock that they follow.
    paused
        True if the cloth is paused.
    frames
        Why a collider or gripper does not follow its frame; empty if all do.

    """
    ok, warn = DiagnosticStatus.OK, DiagnosticStatus.WARN
    if paused:
        return Status('paused', ok, 0.0)
    # Ticks as slow as reports, or slower, may fall before or after one.
    overdue = ticks.ticks == 0 and clock.overdue > _OVERDUE
    jumping = 0 < ticks.ticks == ticks.jumps
    factor = 0.0 if overdue or jumping else report.real_time_factor
    if report.rollbacks.text:
        message = f'unexplained energy: substep batches rolled back, {report.rollbacks.text}'
        return Status(message, warn, factor, logged=True)
    if overdue:
        return Status(f'no tick since the last report: {clock.why_overdue}', warn, factor)
    if report.held:
        return Status(f'the cloth is held: {report.held}', warn, factor)
    if ticks.ticks == 0 and factor == 0:
        return Status('no tick was due yet', ok, factor)
    if jumping:
        message = f'/clock moves by {ticks.jump:.4g} s at once: none of it is simulated'
        return Status(message, warn, factor)
    if report.cause:
        message = (
            f'overload: slow motion, {report.lost:.3g} s lost since the last report: '
            f'{report.cause}'
        )
        return Status(message, warn, factor, logged=True)
    if report.reduction:
        return Status(f'overload: {report.reduction}', warn, factor)
    if frames:
        return Status(frames, warn, factor)
    return Status('running in real time', ok, factor)
