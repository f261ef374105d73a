"""Published figures; `make study` has those that take longer."""

import numpy as np
import pytest

from cloth_ros.tradeoff.published import FIGURES, falling_time


def test_published_figures_are_met():
    short = [figure for figure in FIGURES if figure.steps <= 1e6]
    assert {figure.name.split(',')[0] for figure in short} == {'elastic pendulum', 'folded chain'}
    assert len({figure.name for figure in FIGURES}) == len(FIGURES)
    for figure in short:
        difference = np.abs(np.subtract(figure.run(), figure.values))
        assert (difference <= figure.tolerance).all(), (figure.name, difference)


@pytest.mark.parametrize(('links', 'expected'), [(21, 0.89579), (41, 0.87254), (81, 0.86131)])
def test_a_folded_chain_falls_like_one_of_rigid_links(links, expected):
    """Of rigid links, in their angles, by another program (DOP853)."""
    assert falling_time(links) == pytest.approx(expected, rel=3e-4)
