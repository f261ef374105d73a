"""Signals that end a command."""

import signal
import sys

import pytest

from cloth_ros.interrupt import Interrupt, StopSignal


def test_the_first_signal_raises_and_all_are_recorded():
    """What is raised may be lost on its way: then `check` raises again."""
    before = signal.getsignal(signal.SIGINT)
    stop = StopSignal(signal.SIGINT)
    stop.check()
    with pytest.raises(Interrupt):
        signal.raise_signal(signal.SIGINT)
    signal.raise_signal(signal.SIGINT)  # not while the first is being handled
    assert stop.requested
    with pytest.raises(Interrupt):
        stop.check()
    stop.restore()
    assert signal.getsignal(signal.SIGINT) is before


def test_a_signal_after_defer_is_recorded_only():
    stop = StopSignal(signal.SIGINT)
    stop.defer()
    signal.raise_signal(signal.SIGINT)
    assert stop.requested
    stop.restore()


def test_a_signal_within_deferred_raises_at_its_end():
    stop, reached = StopSignal(signal.SIGINT), []

    def interrupted() -> None:
        with stop.deferred():
            signal.raise_signal(signal.SIGINT)
            reached.append('end')

    with pytest.raises(Interrupt):
        interrupted()
    assert reached == ['end']
    stop.restore()


def test_a_signal_after_deferred_raises_at_once():
    stop = StopSignal(signal.SIGINT)
    with stop.deferred():
        pass
    with pytest.raises(Interrupt):
        signal.raise_signal(signal.SIGINT)
    stop.restore()


class Fails:
    """Object whose destructor fails."""

    def __init__(self, number: int = 0) -> None:
        self._number = number

    def __del__(self) -> None:
        if not self._number:
            raise AttributeError
        signal.raise_signal(self._number)


def test_exceptions_in_destructors_are_printed_unless_a_signal_caused_them(monkeypatch):
    """That of the signal itself, and those of objects whose construction it ended."""
    printed: list[type] = []
    monkeypatch.setattr(
        sys, 'unraisablehook', lambda discarded: printed.append(discarded.exc_type)
    )
    stop = StopSignal(signal.SIGINT)
    Fails()
    assert printed == [AttributeError]
    Fails(signal.SIGINT)
    assert stop.requested
    Fails()
    assert printed == [AttributeError]
    stop.restore()
    Fails()
    assert printed == [AttributeError] * 2
