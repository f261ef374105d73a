"""What came of bad input, counted."""

from __future__ import annotations

import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from cloth_ros.scene.parameter import format_value

from .record import Row

_PATIENCE = 10.0  # s, after which a case hangs
_LONGEST = 1000  # characters of an error that is clear
_KEPT = 5  # cases that a report shows


class HangError(Exception):
    """A case takes too long."""


def is_clear(message: str) -> bool:
    """Tell if an error is one line that can be printed and ends in a remedy, after a semicolon."""
    return message.isprintable() and '; ' in message and len(message) <= _LONGEST


class Tally:
    """
    The outcomes of one kind of input.

    Attributes
    ----------
    what, promised
        For the report.
    names
        What it says of those refused and accepted.
    refused
        How many were refused with a clear error, or counted as refused.
    accepted
        How many were not, and need not be.
    wrong
        What else came, and of what.

    """

    def __init__(
        self,
        what: str,
        promised: str = 'a clear error, or valid; nothing else',
        names: tuple[str, str] = ('refused', 'valid'),
    ) -> None:
        self.what, self.promised, self.names = what, promised, names
        self.refused = self.accepted = 0
        self.wrong: list[str] = []

    def invalid_value_error(self, message: str, case: object) -> None:
        """Count a refusal, for what it says."""
        if is_clear(message):
            self.refused += 1
        else:
            self.blame(f'not clear: {message[:200]}', case)

    def blame(self, outcome: str, case: object) -> None:
        """Note that a case came out as nothing may."""
        text = f'{outcome}, of {format_value(case)}'
        self.wrong.append(text.encode('utf-8', 'backslashreplace').decode())

    @property
    def cases(self) -> int:
        """How many there were."""
        return self.refused + self.accepted + len(self.wrong)

    def row(self) -> Row:
        """Return the report."""
        for wrong in self.wrong[:_KEPT]:
            print(f'  {wrong}', flush=True)
        refused, accepted = self.names
        measured = (
            f'{self.cases:,} cases: {self.refused:,} {refused}, {self.accepted:,} {accepted}, '
            f'{len(self.wrong):,} anything else'
        )
        return Row(self.what, self.promised, measured, not self.wrong)


@contextmanager
def _in_time() -> Iterator[None]:
    def late(_: int, __: FrameType | None) -> None:
        raise HangError(f'not done after {_PATIENCE:g} s')

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, _PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def attempt(tally: Tally, case: object, call: Callable[[], object]) -> bool:
    """
    Call, count what comes of it, and return True if the case was accepted.

    A refusal is a ValueError and nothing else, not one of its subclasses either; a warning is
    wrong, and so is what takes long.
    """
    try:
        with warnings.catch_warnings(), _in_time():
            warnings.simplefilter('error')
            call()
    except Exception as error:
        if type(error) is ValueError:
            tally.invalid_value_error(str(error), case)
        else:
            tally.blame(f'{type(error).__name__}: {error}', case)
        return False
    tally.accepted += 1
    return True
