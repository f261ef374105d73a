"""What arrives from a live node, and how regularly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticStatus

OK = DiagnosticStatus.OK
# Share of the ticks that may be late or missing where a node serves as before.
THROTTLE = 0.02
# Least real-time factor of a report that counts as real time.
REAL_TIME = 0.95


class Arrival(NamedTuple):
    """
    A message of particles.

    Attributes
    ----------
    at, sent
        When it arrived and when it was sent, s; by the steady clock here, by the sender's own.
    stamp
        In its header, s.
    number
        Of the message, counted by its publisher.

    """

    at: float
    sent: float
    stamp: float
    number: int


class Report(NamedTuple):
    """A message of /diagnostics: when it came, its level and text, and its values by name."""

    at: float
    level: bytes
    message: str
    values: dict[str, str]

    @property
    def simulated(self) -> float:
        """Simulated time, s."""
        return float(self.values['simulated time [s]'])

    @property
    def factor(self) -> float:
        """Real-time factor since the report before."""
        return float(self.values['real-time factor'])


@dataclass(frozen=True)
class Ticks:
    """
    How the ticks went in a stretch of time.

    Attributes
    ----------
    count, late
        Pauses between two of them, and how many of these were half a period too long.
    missing
        How many fewer there were than the rate makes.
    longest
        Longest pause, s.
    lost
        Messages that were sent and did not arrive.

    """

    count: int
    late: int
    missing: int
    longest: float
    lost: int

    @property
    def all_arrived(self) -> bool:
        """True if there were messages, and none was lost."""
        return self.count > 0 and self.lost == 0

    @property
    def as_before(self) -> bool:
        """True if no message was lost, and ticks were seldom late or missing."""
        return self.all_arrived and self.late + self.missing <= THROTTLE * self.count

    @property
    def text(self) -> str:
        """All of it, in words."""
        if not self.count:
            return 'no messages'
        return (
            f'{self.late} of {self.count} ticks late, {self.missing} missing, the longest pause '
            f'{self.longest:.3f} s, {self.lost} messages lost'
        )


def total(stretches: Sequence[Ticks]) -> Ticks:
    """Return how the ticks went in several stretches of time."""
    return Ticks(
        sum(each.count for each in stretches),
        sum(each.late for each in stretches),
        sum(each.missing for each in stretches),
        max((each.longest for each in stretches), default=0.0),
        sum(each.lost for each in stretches),
    )


def lost(window: Sequence[Arrival]) -> int:
    """Return how many messages between the first and the last did not arrive."""
    return window[-1].number - window[0].number + 1 - len(window)
