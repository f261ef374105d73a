"""Closed solutions and published figures are met; the solutions detect a wrong force."""

import math

import numpy as np
import pytest

from cloth_ros import Cloth
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff import analytic_cases
from cloth_ros.tradeoff.analytic_cases import ANALYTIC_CASES
from cloth_ros.tradeoff.published import FIGURES, falling_time
from cloth_ros.tradeoff.validation import Result


def simulate_with(monkeypatch, name, change) -> None:
    """Change a parameter in the scenes that are simulated, but not in the solution."""

    def cloth(scene):
        return Cloth(scene.with_parameters({name: change(scene.flat()[name])}))

    monkeypatch.setattr(analytic_cases, 'Cloth', cloth)


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('case', ANALYTIC_CASES, ids=lambda case: case.name)
def test_the_solution_is_met_and_a_fault_of_one_percent_is_detected(case, method, monkeypatch):
    result = case.measure(method)
    assert result.holds, f'{result.error:.2e}, tolerance {result.tolerance:.2e}'
    assert np.shape(result.found) == np.shape(result.exact)
    gravity = (0.01 * 9.81, 0.0, -1.01 * 9.81)  # in size and direction
    wrong = (lambda _: gravity) if case.parameter == 'gravity' else (lambda value: 1.01 * value)
    simulate_with(monkeypatch, case.parameter, wrong)
    assert not case.measure(method).holds
    if case.name == 'hanging chain':
        simulate_with(monkeypatch, 'solver.precision', lambda _: 'single')
        # Positions of up to 0.5 m are rounded to 3e-8 m, the smallest elongation is 0.36 mm.
        assert case.measure(method).error < 1e-3


def test_results_that_are_not_finite_do_not_hold():
    for found in (math.nan, math.inf, np.array([1.0, math.nan])):
        assert not Result('', '', found, np.ones_like(found), tolerance=1e300).holds


@pytest.mark.parametrize(
    'figure',
    # The other ones of the pendulum take as long, and are in `make study`.
    [pytest.param(FIGURES[0], marks=pytest.mark.slow), FIGURES[-1]],
    ids=['elastic pendulum', 'folded chain'],
)
def test_published_figures_are_met(figure, request):
    assert figure.name.startswith(request.node.callspec.id)
    difference = np.abs(np.subtract(figure.run(), figure.values))
    assert (difference <= figure.tolerance).all(), difference


def test_a_folded_chain_falls_as_one_of_rigid_links():
    # Of rigid links with half a mass at the end, in their angles, by another program (DOP853).
    for links, expected in ((21, 0.88267), (41, 0.86495), (81, 0.85706)):
        assert falling_time(links) == pytest.approx(expected, rel=3e-4)
