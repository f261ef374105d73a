"""Closed solutions: every integrator meets each, and each detects a force that is wrong by 1 %."""

import math

import numpy as np
import pytest

from cloth_ros import Cloth
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff import analytic_cases
from cloth_ros.tradeoff.analytic_cases import ANALYTIC_CASES, Result

CASES = {case.name: case for case in ANALYTIC_CASES}
# The parameter that is changed by 1 % in the simulation, but not in the closed solution.
FAULTS = {
    'free fall': 'gravity',
    'oscillator': 'springs.structural',
    'oscillator with a dashpot': 'springs.damping',
    'oscillator with drag': 'drag',
    **dict.fromkeys([f'chain, mode {mode}' for mode in (1, 2, 5, 10)], 'springs.structural'),
    'hanging chain': 'springs.structural',
    'catenary': 'direction of gravity',
    **dict.fromkeys([f'stiff pendulum, {degrees}°' for degrees in (10, 60, 120)], 'gravity'),
    'terminal velocity, drag': 'drag',
    'terminal velocity, air': 'wind.air_density',
    'fall in air': 'wind.drag_coefficient',
    'numerical frequency': 'springs.structural',
    'numerical damping': 'springs.damping',
}
every_integrator = pytest.mark.parametrize('method', INTEGRATORS)


def simulate_with(monkeypatch, **changes):
    """Replace parameters in the scenes that are simulated."""

    def cloth(scene):
        return Cloth(scene.with_parameters({name: new(scene) for name, new in changes.items()}))

    monkeypatch.setattr(analytic_cases, 'Cloth', cloth)


@every_integrator
@pytest.mark.parametrize('name', FAULTS)
def test_the_solution_is_met_and_a_fault_of_one_percent_is_detected(name, method, monkeypatch):
    result = CASES[name].measure(method)
    assert result.holds, f'{result.error:.2e}, tolerance {result.tolerance:.2e}'
    assert np.shape(result.found) == np.shape(result.exact)
    if FAULTS[name] == 'direction of gravity':
        fault = {'gravity': lambda scene: (0.01 * 9.81, 0.0, -9.81)}
    elif FAULTS[name] == 'gravity':
        fault = {'gravity': lambda scene: (0.0, 0.0, -1.01 * 9.81)}
    else:
        fault = {FAULTS[name]: lambda scene: 1.01 * scene.flat()[FAULTS[name]]}
    simulate_with(monkeypatch, **fault)
    assert not CASES[name].measure(method).holds


def test_all_cases_are_tested_and_have_names_of_their_own():
    assert list(FAULTS) == [case.name for case in ANALYTIC_CASES]


@every_integrator
def test_a_chain_sags_by_the_same_in_single_precision(method, monkeypatch):
    simulate_with(monkeypatch, **{'solver.precision': lambda scene: 'single'})
    # Positions of up to 0.5 m are rounded to 3e-8 m, the smallest elongation is 0.36 mm.
    assert CASES['hanging chain'].measure(method).error < 1e-3


def test_a_result_that_is_not_finite_does_not_hold():
    for found in (math.nan, math.inf, np.array([1.0, math.nan])):
        result = Result('', '', found, np.ones_like(found), tolerance=1.0)
        assert result.error == math.inf
        assert not result.holds
