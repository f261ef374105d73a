"""
The services of `simulation_interfaces`, where that package is installed.

It is a standard for simulators.  What the cloth has of it: state, reset and steps.
"""

from __future__ import annotations

from typing import Any

from ..context import Context
from .reset import reset_cloth

_MOST_STEPS = 10_000  # of one request: the node does nothing else meanwhile


def create_simulation_interfaces(context: Context) -> None:
    """Offer `~/get_simulator_features` and so on, if there are their types."""
    try:
        from simulation_interfaces import msg, srv
    except ImportError:
        context.node.get_logger().debug('simulation_interfaces is not installed')
        return
    services = _Services(context, msg, srv)
    for kind, name, handle in (
        (srv.GetSimulatorFeatures, 'get_simulator_features', services.features),
        (srv.GetSimulationState, 'get_simulation_state', services.state),
        (srv.SetSimulationState, 'set_simulation_state', services.set_state),
        (srv.ResetSimulation, 'reset_simulation', services.reset),
        (srv.StepSimulation, 'step_simulation', services.step),
    ):
        context.node.create_service(kind, f'~/{name}', handle)


class _Services:
    """
    What the services do.

    Parameters
    ----------
    context
        Of the node.
    msg, srv
        Modules of simulation_interfaces.

    """

    def __init__(self, context: Context, msg: Any, srv: Any) -> None:
        self._context, self._live = context, context.live
        self._states, self._results, self._features = (
            msg.SimulationState,
            msg.Result,
            msg.SimulatorFeatures,
        )
        self._set, self._reset = srv.SetSimulationState.Response, srv.ResetSimulation.Request
        # Stopped is paused after a reset; until the cloth moves or continues.
        self._stopped_at = -1

    def features(self, _: Any, response: Any) -> Any:
        """Return what is supported."""
        known = self._features
        response.features.features = [
            known.SIMULATION_RESET,
            known.SIMULATION_RESET_TIME,
            known.SIMULATION_RESET_STATE,
            known.SIMULATION_STATE_GETTING,
            known.SIMULATION_STATE_SETTING,
            known.SIMULATION_STATE_PAUSE,
            known.STEP_SIMULATION_SINGLE,
            known.STEP_SIMULATION_MULTIPLE,
        ]
        response.features.custom_info = 'cloth_ros: a step is one tick of the parameter rate'
        return response

    def state(self, _: Any, response: Any) -> Any:
        """Return whether the cloth is paused, stopped or playing."""
        response.state.state = self._present_state()
        return self._ok(response)

    def _present_state(self) -> int:
        if not self._live.paused:
            return int(self._states.STATE_PLAYING)
        stopped = self._live.revision == self._stopped_at
        return int(self._states.STATE_STOPPED if stopped else self._states.STATE_PAUSED)

    def set_state(self, request: Any, response: Any) -> Any:
        """Pause, continue, or stop: pause and reset."""
        states, wanted = self._states, request.state.state
        if wanted not in (states.STATE_STOPPED, states.STATE_PLAYING, states.STATE_PAUSED):
            return self._failed(
                response,
                self._results.RESULT_FEATURE_UNSUPPORTED,
                f'the state is {wanted}, but must be STATE_STOPPED (0), STATE_PLAYING (1) or '
                'STATE_PAUSED (2); end the node with SIGINT',
            )
        if wanted == self._present_state():
            text = 'it is in this state already'
            return self._failed(response, self._set.ALREADY_IN_TARGET_STATE, text)
        self._live.paused = wanted != states.STATE_PLAYING
        self._stopped_at = -1
        if wanted == states.STATE_STOPPED:
            reset_cloth(self._context)
            self._stopped_at = self._live.revision
        return self._ok(response)

    def reset(self, request: Any, response: Any) -> Any:
        """Reset state and time, which belong together."""
        kinds, scope = self._reset, request.scope
        both = kinds.SCOPE_TIME | kinds.SCOPE_STATE
        if scope not in (kinds.SCOPE_DEFAULT, kinds.SCOPE_ALL) and scope & both != both:
            return self._failed(
                response,
                self._results.RESULT_FEATURE_UNSUPPORTED,
                f'the scope is {scope}, but must be SCOPE_DEFAULT (0), SCOPE_ALL (255) or both '
                'SCOPE_TIME and SCOPE_STATE (3): time and state are reset together; use 0',
            )
        reset_cloth(self._context)
        return self._ok(response)

    def step(self, request: Any, response: Any) -> Any:
        """Simulate some ticks while paused."""
        if request.steps > _MOST_STEPS:
            return self._failed(
                response,
                self._results.RESULT_OPERATION_FAILED,
                f'steps is {request.steps}, but must be at most {_MOST_STEPS}; make several calls',
            )
        try:
            for _ in range(request.steps):
                self._context.step()
        except ValueError as error:
            return self._failed(response, self._results.RESULT_OPERATION_FAILED, str(error))
        return self._ok(response)

    def _ok(self, response: Any) -> Any:
        response.result.result = self._results.RESULT_OK
        return response

    def _failed(self, response: Any, result: int, text: str) -> Any:
        response.result.result, response.result.error_message = result, text
        return response
