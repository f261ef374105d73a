"""
An interrupt ends an advance wherever it is raised, and leaves a state of one time.

A signal raises in whatever Python is doing.  Where NumPy is just looking up an attribute, it takes
the exception for a missing attribute, and continues.
"""

import sys
from collections.abc import Callable

import numpy as np
import pytest
from builders import cloth_of


def run_until(work: Callable[[], object], last: int = sys.maxsize) -> int:
    """Run until an interrupt in Python call number `last`; return the number of calls made."""
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


@pytest.mark.parametrize(
    'parameters',
    [
        {'wind__air_density': 0.0},
        {'springs__damping': 1e-4},
        {'sphere__radius': 0.2, 'sphere__position': [0.0, 0.0, 0.9]},
    ],
    ids=['springs', 'air and dashpots', 'contact'],
)
def test_an_advance_is_interrupted_in_every_call_that_it_makes(parameters):
    cloth = cloth_of(sheet__rows=4, sheet__columns=4, **parameters)
    cloth.advance(0.1)  # compiled, and in contact
    start = cloth.snapshot()
    cloth.advance(0.005)  # its tables of operations are made
    cloth.restore(start)
    calls = run_until(lambda: cloth.advance(0.005))
    assert calls > 50
    for last in range(calls):
        cloth.restore(start)
        with pytest.raises(KeyboardInterrupt):
            run_until(lambda: cloth.advance(0.005), last)
        assert start.time <= cloth.time <= start.time + 0.005 + 1e-12
        assert np.isfinite(cloth.positions).all()
    cloth.advance(0.1)


@pytest.mark.parametrize('batches', [0, 20, 41, 100])
@pytest.mark.parametrize('interrupt', ['close', 'throw'])
def test_an_abandoned_advance_ends_with_the_last_accepted_batch(batches, interrupt):
    sphere = {'sphere__radius': 0.1, 'sphere__position': (0.0, 0.0, 2.0)}
    cloth, other = (cloth_of(**sphere, solver__precision='double') for _ in '12')
    cloth.move_sphere((0.0, 0.0, -1.0))
    steps = cloth.advance_stepwise(1.0)
    for _ in range(batches):
        next(steps)
    reached = cloth.time
    if interrupt == 'close':
        steps.close()
    else:
        with pytest.raises(KeyboardInterrupt):
            steps.throw(KeyboardInterrupt)
    assert reached - 0.05 < cloth.time <= reached
    other.move_sphere((0.0, 0.0, 2.0 - 3.0 * cloth.time))
    other.advance(cloth.time)
    np.testing.assert_allclose(cloth.sphere_position[2], 2.0 - 3.0 * cloth.time, atol=1e-9)
    np.testing.assert_allclose(cloth.positions, other.positions, atol=1e-9)
    np.testing.assert_allclose(cloth.velocities, other.velocities, atol=1e-6)
