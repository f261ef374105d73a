"""Signals that end a command."""

import signal

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
