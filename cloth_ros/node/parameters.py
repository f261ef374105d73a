"""The parameters of the node, derived from the scene."""

from __future__ import annotations

import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService

from ..scene import Scene
from ..scene.parameter import (
    PARAMETERS,
    ParameterSpec,
    format_value,
    invalid_value_error,
    one_line,
    unknown_parameter_error,
)
from ..scene.parameter_file import NODE_PARAMETERS
from .qos import QueueDepths, check_policy

_LONGEST = 600  # characters of a reason


def _ros_value(value: Any) -> Any:
    """Return a scene's value as ROS types it."""
    if isinstance(value, tuple):
        return list(value) or ['']  # an empty list has no type
    return value


def _plain(value: Any) -> Any:
    """Return a value that compares: rclpy gives lists as arrays, and as lists."""
    return list(value) if isinstance(value, (tuple, array.array)) else value


def _descriptor(name: str, value: Any, known: ParameterSpec) -> ParameterDescriptor:
    """Describe a parameter: its text, unit and range."""
    text = known.text + (f' [{known.unit}]' if known.unit else '')
    descriptor = ParameterDescriptor(
        name=name,
        description=text,
        additional_constraints=known.range_text,
        read_only=known.fixed,
    )
    if known.low is None or known.high is None or isinstance(value, tuple):
        return descriptor
    if isinstance(value, int):
        limits = IntegerRange(from_value=int(known.low), to_value=int(known.high), step=1)
        descriptor.integer_range = [limits]
    else:
        bounds = FloatingPointRange(from_value=float(known.low), to_value=float(known.high))
        descriptor.floating_point_range = [bounds]
    return descriptor


def declare_scene(node: Node) -> tuple[Scene, QueueDepths]:
    """
    Declare the parameters of a scene on a node; return the scene and queues of its overrides.

    The node must have been made with `automatically_declare_parameters_from_overrides`: the
    overrides are then there untyped, whole numbers for real ones included, and are declared
    again with type, text and range once the scene they make is known to be valid.

    Raises
    ------
    ValueError
        The overrides do not make a valid scene.

    """
    given = {}
    overrides: dict[str, Any] = node.get_parameters_by_prefix('')
    for name, parameter in overrides.items():
        check_policy(name, parameter.value)
        if name.split('.')[0] in NODE_PARAMETERS:
            continue
        if name in PARAMETERS:
            given[name] = parameter.value
            node.undeclare_parameter(name)
        else:
            # A file for several nodes may rightly hold names of others.
            node.get_logger().warning(
                f'ignored: {unknown_parameter_error(name, list(PARAMETERS))}'
            )
    scene = Scene.from_parameters(given)
    queues = QueueDepths.of(node)
    queues.check(scene)
    for name, value in scene.flat().items():
        descriptor = _descriptor(name, value, PARAMETERS[name])
        node.declare_parameter(name, _ros_value(value), descriptor, ignore_override=True)
    return scene, queues


def coerce_types(parameters: Iterable[Parameter]) -> list[Parameter]:
    """Return parameters in the type that is meant, be they whole, real, or an empty list."""
    flat = Scene().flat()
    result = []
    for parameter in parameters:
        default, value = flat.get(parameter.name), parameter.value
        whole = isinstance(value, int) and not isinstance(value, bool)
        is_list = isinstance(value, (list, bytes, array.array))
        if isinstance(default, int) and isinstance(value, float) and value.is_integer():
            parameter = Parameter(parameter.name, Parameter.Type.INTEGER, int(value))
        elif isinstance(default, float) and whole:
            parameter = Parameter(parameter.name, Parameter.Type.DOUBLE, float(value))
        elif isinstance(default, tuple) and isinstance(default[0], str) and is_list and not value:
            parameter = Parameter(parameter.name, Parameter.Type.STRING_ARRAY, [])
        elif isinstance(default, tuple) and parameter.type_ == Parameter.Type.INTEGER_ARRAY:
            numbers = [float(number) for number in value]
            parameter = Parameter(parameter.name, Parameter.Type.DOUBLE_ARRAY, numbers)
        result.append(parameter)
    return result


def changed_scene(scene: Scene, parameters: Iterable[Parameter], queues: QueueDepths) -> Scene:
    """Return `scene` with those of the parameters that are a scene's; raises ValueError."""
    changes = {
        parameter.name: parameter.value for parameter in parameters if parameter.name in PARAMETERS
    }
    if not changes:
        return scene
    changed = scene.with_parameters(changes)
    queues.check(changed)
    return changed


class SafeParameterService(ParameterService):
    """
    The services for parameters.

    rclpy's own end the node with a type that there is not, and say of what they refuse neither
    what is allowed nor a remedy.

    Parameters
    ----------
    node
        Whose parameters.
    check
        Raises ValueError for parameters that cannot be set.
    refused
        Called for each request, or part of one, that is refused.

    """

    def __init__(
        self,
        node: Node,
        check: Callable[[list[Parameter]], None],
        refused: Callable[[], None],
    ) -> None:
        super().__init__(node)
        self._of, self._check, self._refused = node, check, refused

    def _set_parameters_callback(
        self, request: SetParameters.Request, response: SetParameters.Response
    ) -> SetParameters.Response:
        for parameter in request.parameters:
            single = SetParametersAtomically.Request(parameters=[parameter])
            answer = SetParametersAtomically.Response()
            self._set_parameters_atomically_callback(single, answer)
            response.results.append(answer.result)
        return response

    def _set_parameters_atomically_callback(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        try:
            request.parameters = list(self._to_be_set(request.parameters))
        except ValueError as error:
            response.result = SetParametersResult(successful=False, reason=str(error))
        else:
            response.result = SetParametersResult(successful=True)
            if request.parameters:
                super()._set_parameters_atomically_callback(request, response)
        if not response.result.successful:
            self._refused()
        # rclpy quotes names of any length.
        response.result.reason = one_line(response.result.reason)[:_LONGEST]
        return response

    def _to_be_set(self, messages: Sequence[ParameterMessage]) -> Iterator[ParameterMessage]:
        """Yield those that may be set, without what is fixed and stays as it is."""
        parameters = []
        for message in messages:
            try:
                parameters.append(Parameter.from_parameter_msg(message))
            except ValueError:
                name, kind = format_value(message.name), message.value.type
                raise invalid_value_error(
                    f'the type of {name}', kind, '0 to 9', 'see ParameterType'
                ) from None
        parameters = coerce_types(parameters)
        for name, count in Counter(parameter.name for parameter in parameters).items():
            if count > 1:
                raise invalid_value_error(
                    f'the number of {format_value(name)}', count, '1', 'give it once'
                )
        self._check(parameters)
        for message, parameter in zip(messages, parameters, strict=True):
            if not self._is_fixed(parameter.name):
                yield message
                continue
            # Who loads what was dumped from a node sets these as well.
            now = self._of.get_parameter(parameter.name).value
            if _plain(parameter.value) != _plain(now):
                raise invalid_value_error(
                    parameter.name,
                    parameter.value,
                    f'{format_value(now)}, as the node was started',
                    'start the node with it',
                )

    def _is_fixed(self, name: str) -> bool:
        known = PARAMETERS.get(name)
        of_a_queue = name.startswith('qos_overrides.') and self._of.has_parameter(name)
        return of_a_queue or (known is not None and known.fixed)
