"""Warns in the log of values that are almost certainly an error of the unit."""

from __future__ import annotations

from collections.abc import Mapping

from ..scene import Scene
from ..scene.plausibility import implausible_values
from .kernel_compiler import Log


class PlausibilityLog:
    """Warn once of each value, until it is another; `log` receives the warnings."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._known: Mapping[str, str] = {}

    def check(self, scene: Scene) -> None:
        """Warn of the values of a scene."""
        before, self._known = self._known, implausible_values(scene)
        for name, text in self._known.items():
            if before.get(name) != text:
                self._log.warning(f'is this value meant? {text}')
