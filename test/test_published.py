"""Figures that others have published; `make study` has those that take more than seconds."""

import numpy as np
import pytest

from cloth_ros.tradeoff.published import FIGURES, falling_time

SHORT = [figure for figure in FIGURES if figure.steps <= 1e6]


@pytest.mark.parametrize('figure', SHORT, ids=lambda figure: figure.name)
def test_what_was_published_is_found(figure):
    difference = np.abs(np.subtract(figure.run(), figure.values))
    assert (difference <= figure.tolerance).all(), difference


def test_every_system_has_a_figure_that_is_tested_and_a_name_of_its_own():
    names = [figure.name for figure in FIGURES]
    assert len(set(names)) == len(names)
    assert {figure.name.split(',')[0] for figure in SHORT} == {'elastic pendulum', 'folded chain'}


@pytest.mark.parametrize(('links', 'expected'), [(21, 0.89579), (41, 0.87254), (81, 0.86131)])
def test_a_folded_chain_falls_as_one_of_rigid_links(links, expected):
    """Of the same chain with rigid links, in the angles of these, by another program (DOP853)."""
    assert falling_time(links) == pytest.approx(expected, rel=3e-4)
