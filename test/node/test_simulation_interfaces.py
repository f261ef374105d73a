"""
Services of `simulation_interfaces`.

The package is not on PyPI: where it is not installed, only the absence of its services is tested.
"""

import importlib.util
import itertools

import numpy as np
import pytest
from node.conftest import SteppedCloth, at_rest
from ros import numbers, wind

INSTALLED = importlib.util.find_spec('simulation_interfaces') is not None
needs_package = pytest.mark.skipif(not INSTALLED, reason='simulation_interfaces is not installed')


@pytest.mark.skipif(INSTALLED, reason='simulation_interfaces is installed')
def test_without_the_package_nothing_is_missing(cloth: SteppedCloth):
    names = {name for name, _ in cloth.probe.get_service_names_and_types()}
    assert {'/cloth/step', '/cloth/reset', '/cloth/pause'} <= names
    assert not [name for name in names if 'simulat' in name]
    assert 'simulation_interfaces' not in cloth.process.output


@needs_package
def test_state_steps_and_reset(cloth: SteppedCloth):
    from simulation_interfaces import msg, srv

    states, results = msg.SimulationState, msg.Result

    def call(name: str, kind: type, **values: object):
        return cloth.probe.call(kind, f'/cloth/{name}', kind.Request(**values))

    def state() -> int:
        response = call('get_simulation_state', srv.GetSimulationState)
        assert response.result.result == results.RESULT_OK
        return response.state.state

    def set_state(wanted: int):
        value = states(state=wanted)
        return call('set_simulation_state', srv.SetSimulationState, state=value).result

    features = call('get_simulator_features', srv.GetSimulatorFeatures).features.features
    assert {msg.SimulatorFeatures.STEP_SIMULATION_MULTIPLE, 24, 25, 26} <= set(features)
    assert state() == states.STATE_PLAYING
    refused = call('step_simulation', srv.StepSimulation, steps=1).result
    assert refused.result == results.RESULT_OPERATION_FAILED
    assert 'pause it' in refused.error_message
    cloth.send_and_wait('/wind', wind(z=5.0))
    cloth.tick(3)
    assert set_state(states.STATE_PAUSED).result == results.RESULT_OK
    assert state() == states.STATE_PAUSED
    assert set_state(states.STATE_PAUSED).result == 101
    (before,) = cloth.tick()
    first = len(cloth.states)
    done = call('step_simulation', srv.StepSimulation, steps=3).result
    assert done.result == results.RESULT_OK
    cloth.probe.spin_until(lambda: len(cloth.states) >= first + 3)
    after = [numbers(each) for each in cloth.states[first : first + 3]]
    pairs = itertools.pairwise([before, *after])
    assert not any(np.array_equal(one, two) for one, two in pairs)
    refused = call(
        'reset_simulation', srv.ResetSimulation, scope=srv.ResetSimulation.Request.SCOPE_TIME
    )
    assert refused.result.result == results.RESULT_FEATURE_UNSUPPORTED
    assert set_state(states.STATE_STOPPED).result == results.RESULT_OK
    assert state() == states.STATE_STOPPED
    assert at_rest(cloth.tick(2)[-1])
    assert set_state(states.STATE_QUITTING).result == results.RESULT_FEATURE_UNSUPPORTED
    assert set_state(states.STATE_PLAYING).result == results.RESULT_OK
    cloth.send_and_wait('/wind', wind(z=5.0))
    cloth.tick_until(lambda moving: not at_rest(moving))
    assert call('reset_simulation', srv.ResetSimulation).result.result == results.RESULT_OK
    assert state() == states.STATE_PLAYING
    too_many = call('step_simulation', srv.StepSimulation, steps=2**63).result
    assert 'at most 10000' in too_many.error_message
