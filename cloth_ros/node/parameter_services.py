"""Parameter services that reject what rclpy fails on, and say what is allowed."""

from __future__ import annotations

import array
import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService

from ..scene.parameter import (
    declaration,
    format_value,
    invalid_value_error,
    one_line,
    unknown_parameter_error,
)
from ..scene.suggestion import closest_bool
from ..scene.yaml_text import write
from .parameters import SceneParameters, coerce_types

_LONGEST = 600  # characters of a reason


def _comparable(value: Any) -> Any:
    """Return a list for what rclpy gives as list, tuple or array."""
    return list(value) if isinstance(value, (tuple, array.array)) else value


class SafeParameterService(ParameterService):
    """
    The services that read and set parameters.

    rclpy's own end the node at a type that does not exist, and name neither the allowed values nor
    a remedy when they reject one.

    Parameters
    ----------
    node
        Owner of the parameters.
    scene
        Checks and declares the parameters of a scene.
    rejected
        Called for each request, or part of one, that is rejected.

    """

    def __init__(
        self,
        node: Node,
        scene: SceneParameters,
        rejected: Callable[[], None],
    ) -> None:
        super().__init__(node)
        self._owner, self._scene, self._rejected = node, scene, rejected

    def _set_parameters_callback(
        self, request: SetParameters.Request, response: SetParameters.Response
    ) -> SetParameters.Response:
        """
        Set parameters one by one; try again, after the others, what was rejected.

        A file from `ros2 param dump` may name a body before it gives the parameters.
        """
        results = [self._set([parameter]) for parameter in request.parameters]
        for place, parameter in enumerate(request.parameters):
            if not results[place].successful:
                results[place] = self._set([parameter])
        for result in results:
            if not result.successful:
                self._rejected()
        response.results = results
        return response

    def _set_parameters_atomically_callback(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        response.result = self._set(request.parameters)
        if not response.result.successful:
            self._rejected()
        return response

    def _set(self, messages: Sequence[ParameterMessage]) -> SetParametersResult:
        """Set parameters together; return why they cannot be set, or what has no effect yet."""
        try:
            changes = list(self._to_be_set(messages))
        except ValueError as error:
            result = SetParametersResult(successful=False, reason=str(error))
        else:
            result = SetParametersResult(successful=True)
            if changes:
                request = SetParametersAtomically.Request(parameters=changes)
                answer = SetParametersAtomically.Response()
                with self._scene.declared(
                    coerce_types(map(Parameter.from_parameter_msg, changes))
                ):
                    result = super()._set_parameters_atomically_callback(request, answer).result
            if result.successful:
                result.reason = self._without_effect(changes)
        # rclpy quotes names of any length.
        result.reason = one_line(result.reason)[:_LONGEST]
        return result

    def _without_effect(self, messages: Sequence[ParameterMessage]) -> str:
        """Say which parameters have no effect yet, because their body is not named."""
        return '; '.join(
            f'no effect until {" and ".join(map(repr, names))} is in {parameter}'
            for parameter, names in self._scene.unnamed(messages).items()
            if names
        )

    def _to_be_set(self, messages: Sequence[ParameterMessage]) -> Iterator[ParameterMessage]:
        """Yield the parameters to set, without fixed ones that keep their value; ValueError."""
        parameters = []
        for message in messages:
            try:
                parameters.append(Parameter.from_parameter_msg(message))
            except ValueError:
                name, kind = format_value(message.name), message.value.type
                raise invalid_value_error(
                    f'the type of {name}', kind, '0 to 9', 'see rcl_interfaces/msg/ParameterType'
                ) from None
        parameters = coerce_types(parameters)
        for name, count in Counter(parameter.name for parameter in parameters).items():
            if count > 1:
                raise invalid_value_error(
                    f'the number of {format_value(name)}', count, '1', 'give it once'
                )
        for parameter in parameters:
            self._check_own(parameter)
        self._scene.check(parameters)
        for message, parameter in zip(messages, parameters, strict=True):
            if not self._is_fixed(parameter.name):
                yield message
                continue
            # A file that was dumped from a node contains the fixed ones as well.
            now = self._owner.get_parameter(parameter.name).value
            if _comparable(parameter.value) != _comparable(now):
                rule = f'{parameter.name}:={write(_comparable(parameter.value))}'
                raise invalid_value_error(
                    parameter.name,
                    parameter.value,
                    f'{format_value(now)}, as the node was started',
                    f'start the node with -p {shlex.quote(rule)}',
                )

    def _check_own(self, parameter: Parameter) -> None:
        """Raise ValueError for a name that the node does not have, and for another type."""
        name, owner = parameter.name, self._owner
        if declaration(name) is not None:
            return
        if not owner.has_parameter(name):
            own = [known for known in owner.get_parameters_by_prefix('') if known]
            raise unknown_parameter_error(name, others=own)
        now = owner.get_parameter(name).value
        if isinstance(now, bool) and not isinstance(parameter.value, bool):
            remedy = f'write {write(closest_bool(parameter.value, not now))}'
            raise invalid_value_error(name, parameter.value, 'true or false', remedy)

    def _is_fixed(self, name: str) -> bool:
        owner = self._owner
        read_only = owner.has_parameter(name) and owner.describe_parameter(name).read_only
        return bool(read_only or name.startswith('qos_overrides.'))
