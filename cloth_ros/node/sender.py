"""The thread that sends the messages of a node."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait

from .abandoned_locks import release_abandoned_locks

_LONG = 0.02  # s; to send a message takes less, unless there is no processor for it
_LONGEST_END = 2.0  # s
_SHARE = 0.05  # of the time, to look for locks: there are as many as subscribers


class Sender:
    """Calls functions in a thread of its own, one after the other."""

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(1, 'sender')  # starts no thread yet
        self._error: BaseException | None = None
        self._began: float | None = None  # s; the call that goes on
        self._next = 0.0  # s, from when on to look for locks again

    def submit(self, function: Callable[[], None]) -> None:
        """Call a function soon; raise what a former one has raised."""
        if self._error is not None:
            raise self._error
        self._executor.submit(self._call, function).add_done_callback(self._note)

    def _call(self, function: Callable[[], None]) -> None:
        self._began = time.monotonic()
        try:
            function()
        finally:
            self._began = None

    def free(self) -> list[int]:
        """
        Free the thread, if it waits for a lock of a process that is stopped or dead.

        Returns
        -------
        list of int
            Threads that held such a lock, by their numbers.

        """
        now, began = time.monotonic(), self._began
        if began is None or now - began < _LONG or now < self._next:
            return []
        threads = release_abandoned_locks()
        end = time.monotonic()
        self._next = max(now + _LONG, end + (end - now) / _SHARE)
        return threads

    def _note(self, future: Future[None]) -> None:
        if not future.cancelled():
            self._error = self._error or future.exception()

    def close(self) -> None:
        """Wait until all has been called, but not long; what is left is not called."""
        last = self._executor.submit(lambda: None)
        end = time.monotonic() + _LONGEST_END
        while not last.done() and time.monotonic() < end:
            self.free()
            wait([last], _LONG)
        self._executor.shutdown(wait=False, cancel_futures=True)
