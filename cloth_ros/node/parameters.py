"""The parameters of a scene as parameters of the node: declared, converted and followed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
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
    ParameterSpec,
    convert,
    declaration,
    is_group,
    unknown_parameter_error,
)
from ..scene.parameter_file import NODE_PARAMETERS
from ..scene.yaml_text import write
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
        if declaration(name) is not None or is_group(name):
            given[name] = parameter.value
            node.undeclare_parameter(name)
        else:
            # A file for several nodes may contain names of others.
            node.get_logger().warning(f'ignored: {unknown_parameter_error(name)}')
    scene = Scene.from_parameters(given)
    check_scene(scene)
    queues = QueueDepths.of(node)
    queues.check(scene)
    declare_missing(node, scene)
    for group in scene.named_groups:
        for each in group.unnamed:
            names = f'{group.prefix}names'
            node.get_logger().warning(
                f'the parameters of the {each.kind} {each.name!r} have no effect: it is not in '
                f'{names}; write {names}: {write([*group.names, each.name])}'
            )
    return scene, queues


def declare_missing(node: Node, scene: Scene) -> None:
    """Declare the parameters of a scene that a node does not have yet, with their values."""
    for name, value in scene.flat().items():
        if not node.has_parameter(name):
            known = declaration(name)
            assert known is not None
            descriptor = _descriptor(name, value, known.spec)
            node.declare_parameter(name, _ros_value(value), descriptor, ignore_override=True)


def undeclare_removed(node: Node, before: Scene, after: Scene) -> None:
    """Undeclare the parameters of colliders and grippers that a scene has no longer."""
    for name in before.flat().keys() - after.flat().keys():
        if node.has_parameter(name):
            node.undeclare_parameter(name)


def coerce_types(parameters: Iterable[Parameter]) -> list[Parameter]:
    """Return parameters in the types of the scene, where that is what their values mean."""
    result = []
    for parameter in parameters:
        name = parameter.name
        known = declaration(name)
        if known is not None:
            # What is not valid is rejected later, with this reason.
            with suppress(ValueError):
                value = convert(name, parameter.value, known.default, known.spec)
                items = list(value) if isinstance(value, tuple) else value
                parameter = Parameter(name, _type(known.default), items)
        result.append(parameter)
    return result


def _type(default: Any) -> Parameter.Type:
    """Return the type of a parameter with this default."""
    if isinstance(default, tuple):
        is_number = bool(default) and isinstance(default[0], float)
        return Parameter.Type.DOUBLE_ARRAY if is_number else Parameter.Type.STRING_ARRAY
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
        parameter.name: parameter.value
        for parameter in parameters
        if declaration(parameter.name) is not None
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
        self._node, self._queues, self._apply = node, queues, apply
        self._declaring = False

    def follow(self) -> None:
        """Check and follow what is set from now on."""
        node = self._node
        node.add_pre_set_parameters_callback(coerce_types)
        node.add_on_set_parameters_callback(self._may_be_set)
        node.add_post_set_parameters_callback(self._were_set)

    def check(self, parameters: Iterable[Parameter]) -> None:
        """Raise ValueError if these parameters cannot be set."""
        changed_scene(self.scene, parameters, self._queues)

    @contextmanager
    def declared(self, parameters: Iterable[Parameter]) -> Iterator[None]:
        """
        Declare the parameters of colliders and grippers that have none so far; set them then.

        rclpy sets declared parameters only.  What was not set in the end is undeclared.

        Raises
        ------
        ValueError
            The parameters cannot be set.

        """
        changed = changed_scene(self.scene, parameters, self._queues)
        with self._unfollowed():
            declare_missing(self._node, changed)
        yield
        undeclare_removed(self._node, changed, self.scene)

    @contextmanager
    def _unfollowed(self) -> Iterator[None]:
        """Declare parameters of a valid scene: neither checked nor followed."""
        self._declaring = True
        try:
            yield
        finally:
            self._declaring = False

    def set_values(self, values: Mapping[str, Any]) -> None:
        """Set parameters of a scene together, with the values of a scene; raises ValueError."""
        parameters = [Parameter(name, value=_ros_value(value)) for name, value in values.items()]
        if not parameters:
            return
        with self.declared(coerce_types(parameters)):
            result = self._node.set_parameters_atomically(parameters)
        if not result.successful:
            raise ValueError(result.reason)

    def unnamed(self, parameters: Iterable[Parameter]) -> dict[str, list[str]]:
        """Return the bodies that parameters belong to, by the parameter that lacks their names."""
        given = {parameter.name.rpartition('.')[0] for parameter in parameters}
        return {
            f'{group.prefix}names': [
                each.name for each in group.unnamed if group.prefix + each.name in given
            ]
            for group in self.scene.named_groups
        }

    def _may_be_set(self, parameters: list[Parameter]) -> SetParametersResult:
        if self._declaring:
            return SetParametersResult(successful=True)
        try:
            self.check(parameters)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _were_set(self, parameters: list[Parameter]) -> None:
        if self._declaring:
            return
        before, self.scene = self.scene, changed_scene(self.scene, parameters, self._queues)
        # With their names, new colliders and grippers may come and others go.
        with self._unfollowed():
            declare_missing(self._node, self.scene)
            undeclare_removed(self._node, before, self.scene)
        self._apply(self.scene)
