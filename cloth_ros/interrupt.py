"""Signals that end a command: the first raises `Interrupt`, and a flag records all of them."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs


class Interrupt(BaseException):
    """
    Raised in the main thread by the first signal that ends a command.

    Not a KeyboardInterrupt: where one passes through `exec`, which Numba uses, Python ends itself
    by SIGINT although the exception was caught.
    """


class StopSignal:
    """
    Handle the signals that end a command.

    The first signal raises `Interrupt`, unless that is switched off by `defer`; every signal sets
    `requested`.  Code that catches `Interrupt` must check `requested` as well, because the
    exception can be converted or lost on its way up: an import turns it into ImportError, a kernel
    of Numba into SystemError, and an attribute lookup by NumPy discards it.

    In a destructor or a callback from C, Python would print the exception and go on.  It does not
    do so once `Interrupt` was raised: what is discarded then is that, or an error of an object
    that was left half made, such as one of LLVM without its pointer.

    Parameters
    ----------
    numbers
        The signals, whose handlers are replaced when the object is made.

    Attributes
    ----------
    requested
        True once a signal has been received.

    """

    def __init__(self, *numbers: signal.Signals) -> None:
        self.requested = False
        self._raises = True
        self._raised = False
        self._former_hook, sys.unraisablehook = sys.unraisablehook, self._report_discarded
        self._former = {number: signal.signal(number, self._handle) for number in numbers}

    def _handle(self, _: int, __: FrameType | None) -> None:
        self.requested = True
        if self._raises:
            self._raises, self._raised = False, True
            raise Interrupt

    def _report_discarded(self, discarded: UnraisableHookArgs) -> None:
        if not self._raised:
            self._former_hook(discarded)

    def defer(self) -> None:
        """Raise no exception from here on: the caller polls `requested`."""
        self._raises = False

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """
        Raise `Interrupt` not within a block but at its end.

        For imports: an exception from the loading of a library in C++ can end the process.
        """
        self._raises = False
        yield
        self.check()
        self._raises = True

    def check(self) -> None:
        """Raise `Interrupt` if a signal was received: the exception it raised may be lost."""
        if self.requested:
            raise Interrupt

    def restore(self) -> None:
        """Restore the former handlers of the signals, and of exceptions that are discarded."""
        sys.unraisablehook = self._former_hook
        for number, handler in self._former.items():
            signal.signal(number, handler)
