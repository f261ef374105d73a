"""
Ctrl-C is heard wherever it comes.

It raises in whatever Python is doing.  Where NumPy is just looking something up in an object, it
takes that for "there is none", and goes on.
"""

import signal
import sys
from collections.abc import Callable

import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.interrupt import Interrupt, StopSignal

SCENES = {
    'springs alone': {'wind.air_density': 0.0, 'springs.damping': 0.0},
    'air and dashpots': {},
    'a sphere': {'sphere.radius': 0.2, 'sphere.position': [0.0, 0.0, 0.9]},
}


def called(work: Callable[[], object], last: int = sys.maxsize) -> int:
    """Do some work until Ctrl-C at its call of number `last`; return how many calls it made."""
    number = 0

    def trace(*_: object) -> None:
        nonlocal number
        number += 1
        if number > last:
            raise KeyboardInterrupt

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        work()
    finally:
        sys.settrace(before)
    return number


@pytest.mark.parametrize('values', SCENES.values(), ids=SCENES)
def test_an_advance_is_interrupted_wherever_it_is(values):
    small = {'sheet.rows': 4, 'sheet.columns': 4}
    cloth = Cloth(Scene().with_parameters(small | values))

    def advance() -> None:
        cloth.advance(0.005)

    cloth.advance(0.1)  # compiled, and in touch
    advance()  # its tables of passes are made
    calls = called(advance)
    assert calls > 50
    heard = 0
    for last in range(calls):
        try:
            assert called(advance, last) <= last, 'went on after Ctrl-C'
        except KeyboardInterrupt:
            heard += 1
    assert heard > 0.5 * calls  # not all advances make as many
    cloth.advance(0.1)


def test_a_signal_that_is_lost_on_its_way_has_left_word():
    before = signal.getsignal(signal.SIGINT)
    stop = StopSignal(signal.SIGINT)
    stop.check()
    with pytest.raises(Interrupt):
        signal.raise_signal(signal.SIGINT)
    signal.raise_signal(signal.SIGINT)  # once is enough: what has been begun is cleared up
    assert stop.requested
    with pytest.raises(Interrupt):
        stop.check()
    stop.restore()
    assert signal.getsignal(signal.SIGINT) is before
