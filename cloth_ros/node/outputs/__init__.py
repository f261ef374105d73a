"""
Topics that are published at each tick.

A new topic is a module here, whose class is made from the `Context` of the node, and one entry
below.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ..context import Context
from .markers import MarkersOutput
from .particles import ParticlesOutput


class Output(Protocol):
    """A topic that is published at each tick, or at some of them."""

    @property
    def topic(self) -> str:
        """Full name of the topic."""

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


OUTPUTS: tuple[Callable[[Context], Output], ...] = (ParticlesOutput, MarkersOutput)
