"""
Topics that command the cloth.

A new input is a module here, whose class is made from the `Context` of the node, and one entry
below.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ...scene import Scene
from ..context import Context
from .body_poses import BodyPoses
from .wind import WindInput


class Input(Protocol):
    """One or more topics with commands."""

    @property
    def topics(self) -> list[str]:
        """Full names of the topics."""

    def follow(self, scene: Scene) -> None:
        """Subscribe to what a scene requires; called at the start, and when it has changed."""


INPUTS: tuple[Callable[[Context], Input], ...] = (WindInput, BodyPoses)
