"""Parts of a batch, for which the triangles of the sheet are measured."""

import itertools
import math

import pytest
from builders import NEGLIGIBLE_AIR, cloth_of
from colliders import NAME, depth, solid, turn
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


@pytest.mark.parametrize('spin', [0.0, 1.0])
def test_a_moving_plane_is_met_where_it_is_in_each_part(tmp_path, spin):
    """It lifts a soft sheet, whose shortest batch has steps of several parts, and turns, rad/s."""
    body = solid('plane', 0.0, tmp_path)
    springs = {f'springs__{name}': 0.2 for name in ('structural', 'shear', 'bending')}
    cloth = cloth_of(
        sheet__rows=5, sheet__columns=5, sheet__size=(0.04, 0.04), sheet__mass=0.1,
        sheet__position=(0, 0, 1), pins=[''], rate=2.0, **springs, **NEGLIGIBLE_AIR,
        **body.scene((0, 0, 1), friction=10.0),
    )  # fmt: skip
    for n in (1, 2, 3):
        cloth.move_collider(NAME, (0, 0, 1 + 0.2 * n), turn((1, 0.5, 0), 0.5 * spin * n))
        for _ in cloth.advance_stepwise(0.5):
            assert cloth.substeps < 0.5 / LONGEST * 17 / 2
        assert -1e-3 < depth(cloth, body) < body.tolerance
