"""The thread that sends the messages of a node."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor


class Sender:
    """Calls functions in a thread of its own, one after the other."""

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(1, 'sender')  # starts no thread yet
        self._error: BaseException | None = None

    def submit(self, function: Callable[[], None]) -> None:
        """Call a function soon; raise what a former one has raised."""
        if self._error is not None:
            raise self._error
        self._executor.submit(function).add_done_callback(self._note)

    def _note(self, future: Future[None]) -> None:
        self._error = self._error or future.exception()

    def close(self) -> None:
        """Wait until all has been called."""
        self._executor.shutdown()
