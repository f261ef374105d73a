"""The thread that sends the messages of a node."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor


class Sender:
    """Calls functions in a thread of its own, one after the other."""

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(1, 'sender')  # starts no thread yet
        self._newest: Future[None] | None = None

    def submit(self, function: Callable[[], None]) -> None:
        """Call a function soon; raise what the last one raised, if it has ended."""
        if self._newest is not None and self._newest.done():
            self._newest.result()
        self._newest = self._executor.submit(function)

    def close(self) -> None:
        """Wait until all has been called."""
        self._executor.shutdown()
