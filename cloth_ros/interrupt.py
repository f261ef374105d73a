"""Signals that ask to stop, remembered: what they raise may be lost on its way up."""

from __future__ import annotations

import signal
from types import FrameType


class Interrupt(BaseException):
    """
    A signal asks to stop.

    Not KeyboardInterrupt: where one passes through `exec`, which Numba uses, Python ends itself by
    SIGINT although it was caught.
    """


class Stop:
    """
    What signals ask for.

    The first raises `Interrupt`, unless that is put off; all leave word.  Who catches `Interrupt`
    must look at `asked` too: an import makes it ImportError, a kernel of Numba SystemError, and a
    lookup of NumPy nothing at all.

    Parameters
    ----------
    numbers
        The signals, which are handled from here on.

    Attributes
    ----------
    asked
        True once a signal has come.

    """

    def __init__(self, *numbers: signal.Signals) -> None:
        self.asked = False
        self._raising = True
        self._before = {number: signal.signal(number, self._ask) for number in numbers}

    def _ask(self, _: int, __: FrameType | None) -> None:
        self.asked = True
        if self._raising:
            self._raising = False
            raise Interrupt

    def defer(self) -> None:
        """Raise no longer, from here on."""
        self._raising = False

    def check(self) -> None:
        """Raise `Interrupt` if a signal has come: the one that it raised may have been lost."""
        if self.asked:
            raise Interrupt

    def release(self) -> None:
        """Leave the signals to whoever handled them before."""
        for number, handler in self._before.items():
            signal.signal(number, handler)
