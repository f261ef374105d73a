"""The search for the largest live sheet, over made-up costs."""

import pytest

from bench.live_sheets import SHARE, largest_live, worst_share


@pytest.mark.parametrize('power', [2, 3, 4])
@pytest.mark.parametrize('largest', [16, 40, 125, 333])
def test_the_largest_live_side_is_found(power, largest):
    measured = []

    def share_of(side):
        assert side not in measured  # each takes seconds
        measured.append(side)
        return SHARE * (side / largest) ** power

    found = largest_live(share_of)
    assert found.side == largest // 8 * 8
    assert found.share <= SHARE
    assert len(measured) <= 6


def test_without_a_live_sheet_none_is_found():
    assert largest_live(lambda _: 2.0).side == 0


def test_the_worst_second_counts():
    assert worst_share([0.01] * 60 + [0.02] * 60 + [0.01] * 60) == pytest.approx(1.2)
    assert worst_share([0.03] * 5) == pytest.approx(1.8)  # given up
