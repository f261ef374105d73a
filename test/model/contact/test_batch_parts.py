"""Parts of a batch, for which the triangles of the sheet are measured."""

import itertools
import math

from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.contact.batch_parts import LONGEST, parts_of
from cloth_ros.model.integrators.integrator import Step


@given(count=st.integers(1, 90), h=st.floats(1e-6, 0.1))
def test_parts_are_short_and_have_every_step(count, h):
    """None is empty: a step may be longer than a part should be."""
    steps = (Step(None, h),) * count
    batch = parts_of(steps)
    assert tuple(itertools.chain.from_iterable(part.steps for part in batch.parts)) == steps
    for part in batch.parts:
        assert part.steps
        assert math.isclose(part.seconds, len(part.steps) * h, rel_tol=1e-9)
        assert len(part.steps) == 1 or part.seconds < LONGEST + h
    assert math.isclose(batch.times[-1], count * h)
