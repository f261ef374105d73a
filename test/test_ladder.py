import math

import numpy as np
import pytest

from cloth_ros.model import simulation
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.tradeoff import analytic_cases
from cloth_ros.tradeoff.analytic_cases import ANALYTIC_CASES, AnalyticCase, Result

BY_NAME = {system.name: system for system in ANALYTIC_CASES}

# The parameter of each system that its answer must betray if the forces use another value.
FAULTS = {
    'free fall': 'gravity',
    'oscillator': 'springs.structural',
    'oscillator with a dashpot': 'springs.damping',
    'oscillator with drag': 'drag',
    'chain, mode 1': 'springs.structural',
    'chain, mode 2': 'springs.structural',
    'chain, mode 5': 'springs.structural',
    'chain, mode 10': 'springs.structural',
    'hanging chain': 'springs.structural',
    'catenary': 'direction of gravity',
    'stiff pendulum, 10°': 'gravity',
    'stiff pendulum, 60°': 'gravity',
    'stiff pendulum, 120°': 'gravity',
    'terminal velocity, drag': 'drag',
    'terminal velocity, air': 'wind.air_density',
    'fall in air': 'wind.drag_coefficient',
    'numerical frequency': 'springs.structural',
    'numerical damping': 'springs.damping',
}


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('system', ANALYTIC_CASES, ids=lambda system: system.name)
def test_every_method_finds_what_is_known(system: AnalyticCase, method: str):
    result = system.measure(method)
    assert result.holds, f'{result.error:.2e}, tolerable is {result.tolerance:.2e}'
    assert np.shape(result.found) == np.shape(result.exact)


def test_systems_have_names_of_their_own_and_each_has_a_fault():
    assert len(BY_NAME) == len(ANALYTIC_CASES)
    assert FAULTS.keys() == BY_NAME.keys()


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize(('name', 'fault'), FAULTS.items())
def test_forces_that_are_wrong_by_a_hundredth_are_caught(name, fault, method, monkeypatch):
    def faulty(scene, *others):
        if fault == 'direction of gravity':
            x, y, z = scene.gravity
            changes = {'gravity': [x - 0.01 * z, y, z]}
        elif fault == 'gravity':
            changes = {'gravity': [1.01 * component for component in scene.gravity]}
        else:
            changes = {fault: 1.01 * scene.flat()[fault]}
        return KickDrift(scene.with_parameters(changes), *others)

    monkeypatch.setattr(simulation, 'Dynamics', faulty)
    assert not BY_NAME[name].measure(method).holds


def test_a_result_that_is_not_finite_does_not_hold():
    for found in (math.nan, math.inf, np.array([1.0, math.nan])):
        result = Result('', '', found, np.ones_like(found), tolerance=1.0)
        assert result.error == math.inf
        assert not result.holds


@pytest.mark.parametrize('method', INTEGRATORS)
def test_a_chain_sags_as_well_in_single_precision(method, monkeypatch):
    def single(method, **changes):
        return double(method, **changes).with_parameters({'solver.precision': 'single'})

    double = analytic_cases.scene
    monkeypatch.setattr(analytic_cases, 'scene', single)
    # Positions of up to 0.5 m are rounded to 3e-8 m, the least stretch is 0.36 mm.
    assert BY_NAME['hanging chain'].measure(method).error < 1e-3
