"""Pass what a user does on the page to the thread of the node."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable

_MOST = 256  # different actions that wait


class Actions:
    """
    Actions that wait for the thread of the node, the newest one of each key.

    The page calls back in threads of its own, and as often as a mouse moves.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: dict[Hashable, Callable[[], None]] = {}

    def put(self, key: Hashable, action: Callable[[], None]) -> None:
        """Replace the action of this key that waits; safe in any thread."""
        with self._lock:
            if key in self._waiting or len(self._waiting) < _MOST:
                self._waiting[key] = action

    def run(self) -> None:
        """Carry out what waits, in the order in which the keys came."""
        with self._lock:
            waiting, self._waiting = self._waiting, {}
        for action in waiting.values():
            action()
