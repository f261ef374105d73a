"""The parameters of a scene as parameters of the node: declared, converted and followed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..model import check_scene
from ..scene import Scene
from ..scene.parameter import (
    DEFAULTS,
    GROUPS,
    PARAMETERS,
    ParameterSpec,
    convert,
    unknown_parameter_error,
)
from ..scene.parameter_file import NODE_PARAMETERS
from .qos import QueueDepths, check_policy


def _ros_value(value: Any) -> Any:
    """Return a value of a scene in a type of ROS."""
    if isinstance(value, tuple):
        return list(value) or ['']  # an empty list has no type
    return value


def _descriptor(name: str, value: Any, spec: ParameterSpec) -> ParameterDescriptor:
    """Return the descriptor of a parameter: text, unit and range."""
    text = spec.text + (f' [{spec.unit}]' if spec.unit else '')
    descriptor = ParameterDescriptor(
        name=name,
        description=text,
        additional_constraints=spec.range_text,
        read_only=spec.fixed,
    )
    if spec.low is None or spec.high is None or isinstance(value, tuple):
        return descriptor
    if isinstance(value, int):
        limits = IntegerRange(from_value=int(spec.low), to_value=int(spec.high), step=1)
        descriptor.integer_range = [limits]
    else:
        bounds = FloatingPointRange(from_value=float(spec.low), to_value=float(spec.high))
        descriptor.floating_point_range = [bounds]
    return descriptor


def declare_scene(node: Node) -> tuple[Scene, QueueDepths]:
    """
    Declare the parameters of a scene on a node; return the scene and queues of its overrides.

    The node must have been made with `automatically_declare_parameters_from_overrides`: the
    overrides are then declared without type, whole numbers for real ones included, and are
    declared again with type, text and range once the scene that they make is known to be valid.

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
        if name in PARAMETERS or name in GROUPS:
            given[name] = parameter.value
            node.undeclare_parameter(name)
        else:
            # A file for several nodes may contain names of others.
            node.get_logger().warning(f'ignored: {unknown_parameter_error(name)}')
    scene = Scene.from_parameters(given)
    check_scene(scene)
    queues = QueueDepths.of(node)
    queues.check(scene)
    for name, value in scene.flat().items():
        descriptor = _descriptor(name, value, PARAMETERS[name])
        node.declare_parameter(name, _ros_value(value), descriptor, ignore_override=True)
    return scene, queues


def coerce_types(parameters: Iterable[Parameter]) -> list[Parameter]:
    """Return parameters in the types of the scene, where that is what their values mean."""
    result = []
    for parameter in parameters:
        name = parameter.name
        if name in PARAMETERS:
            # What is not valid is rejected later, with this reason.
            with suppress(ValueError):
                value = convert(name, parameter.value, DEFAULTS[name], PARAMETERS[name])
                items = list(value) if isinstance(value, tuple) else value
                parameter = Parameter(name, _type(DEFAULTS[name]), items)
        result.append(parameter)
    return result


def _type(default: Any) -> Parameter.Type:
    """Return the type of a parameter with this default."""
    if isinstance(default, tuple):
        is_text = isinstance(default[0], str)
        return Parameter.Type.STRING_ARRAY if is_text else Parameter.Type.DOUBLE_ARRAY
    kind: Parameter.Type = Parameter.Type.from_parameter_value(default)
    return kind


def changed_scene(scene: Scene, parameters: Iterable[Parameter], queues: QueueDepths) -> Scene:
    """
    Return `scene` with those of the parameters that belong to a scene.

    Raises
    ------
    ValueError
        The result is not valid, cannot be simulated, or takes too much memory.

    """
    changes = {
        parameter.name: parameter.value for parameter in parameters if parameter.name in PARAMETERS
    }
    if not changes:
        return scene
    changed = scene.with_parameters(changes)
    check_scene(changed)
    queues.check(changed)
    return changed


class SceneParameters:
    """
    Follow the parameters of a node.

    Parameters
    ----------
    node
        Whose parameters were declared by `declare_scene`.
    scene, queues
        What that has returned.
    apply
        Called with the scene whenever parameters were set.

    Attributes
    ----------
    scene
        The scene that the parameters make.

    """

    def __init__(
        self, node: Node, scene: Scene, queues: QueueDepths, apply: Callable[[Scene], None]
    ) -> None:
        self.scene = scene
        self._queues, self._apply = queues, apply
        node.add_pre_set_parameters_callback(coerce_types)
        node.add_on_set_parameters_callback(self._may_be_set)
        node.add_post_set_parameters_callback(self._were_set)

    def check(self, parameters: Iterable[Parameter]) -> None:
        """Raise ValueError if these parameters cannot be set."""
        changed_scene(self.scene, parameters, self._queues)

    def _may_be_set(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            self.check(parameters)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _were_set(self, parameters: list[Parameter]) -> None:
        self.scene = changed_scene(self.scene, parameters, self._queues)
        self._apply(self.scene)
