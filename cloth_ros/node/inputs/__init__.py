"""
Topics that command the cloth.

A new input is a module here, with a function that subscribes and returns the names of its topics,
and one entry below.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ..context import Context
from .collider_poses import subscribe_to_collider_poses
from .wind import subscribe_to_wind

INPUTS: tuple[Callable[[Context], Iterable[str]], ...] = (
    subscribe_to_wind,
    subscribe_to_collider_poses,
)
