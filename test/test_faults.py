"""The faults of `make faults`, each in a short form, on real processes."""

import pytest

from reliability.faults import ALONE, SCENE, SHARED
from reliability.faults.cannot import CannotDoError
from reliability.live import live

# One compiles everything anew, several times; the other is in test_node.py.
_ELSEWHERE = ('compiling', 'clock_jumps')
_SHARED, _ALONE = (
    [fault for fault in faults if fault.__name__ not in _ELSEWHERE] for faults in (SHARED, ALONE)
)


@pytest.fixture(scope='module')
def running():
    """A node that bears all of them, one after the other."""
    with live(*SCENE) as node:
        yield node


@pytest.mark.parametrize('fault', _SHARED, ids=lambda fault: fault.__name__)
def test_a_running_node_outlives(fault, running):
    row = fault(running, quick=True)
    assert row.kept, row.measured


@pytest.mark.parametrize('fault', _ALONE, ids=lambda fault: fault.__name__)
def test_a_node_outlives(fault):
    try:
        row = fault(quick=True)
    except CannotDoError as reason:
        pytest.skip(str(reason))
    assert row.kept, row.measured
