"""
Topics that are published at each tick.

A new one is a module here, whose class is made from the `Context` of the node, and one entry
below.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from ..context import Context
from .markers import MarkersOutput
from .particles import ParticlesOutput
from .recording import RecordingOutput
from .wrenches import WrenchesOutput


class Output(Protocol):
    """One or more topics that are published at each tick, or at some of them."""

    @property
    def topics(self) -> Sequence[str]:
        """Full names of the topics."""

    def publish(self, now: float, stamp: int) -> None:
        """
        Publish the present state, if there is a subscriber.

        Parameters
        ----------
        now
            Time of the tick, s, by the clock that ticks follow.
        stamp
            Time at which the state is valid, ns.

        """


OUTPUTS: tuple[Callable[[Context], Output], ...] = (
    ParticlesOutput,
    MarkersOutput,
    WrenchesOutput,
    RecordingOutput,
)
