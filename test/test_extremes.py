"""The extremes of every parameter, each with what is expected of it; `make extremes` has more."""

import pytest

from reliability.extremes import cases


@pytest.mark.parametrize('case', list(cases(quick=True)), ids=lambda case: case.what)
def test_an_extreme_comes_out_as_promised(case):
    row = case.row()
    assert row.kept, row.measured
