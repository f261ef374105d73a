"""Parameters of the node of a cloth: values, descriptions, and requests to set them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future

# s, after which a request is repeated: a node may answer before it has discovered the client, and
# the answer is lost.
_PATIENCE = 3.0
_MOST = 1000  # parameters that are read

Report = Callable[[str], None]


class NodeParameters:
    """
    Follow and set the parameters of another node.

    Parameters
    ----------
    node
        Owner of the clients.
    remote
        Full name of the other node.
    refused
        Called with the reason when the other node rejects a value.

    Attributes
    ----------
    values
        By name; empty until they are received.
    descriptions
        Text, unit and range of each, as the other node describes it.
    revision
        Increases with every change of `values`.

    """

    def __init__(self, node: Node, remote: str, refused: Report) -> None:
        self.values: dict[str, Any] = {}
        self.descriptions: dict[str, str] = {}
        self.revision = 0
        self._client = AsyncParameterClient(node, remote)
        self._refused = refused
        self._stale = True
        self._reading_since = self._setting_since = -_PATIENCE
        self._requests = 0
        self._wanted: dict[str, Any] = {}

    @property
    def available(self) -> bool:
        """True if the node answers requests; nobody does while a recording is played."""
        return bool(self._client.services_are_ready())

    def refresh(self) -> None:
        """Read all parameters again."""
        self._stale, self._reading_since = True, -_PATIENCE

    def set(self, name: str, value: object) -> None:
        """Set a parameter; of several values in a short time, the last one."""
        self._wanted[name] = value

    def update(self, now: float) -> None:
        """Send the requests that are due at `now`, s."""
        if not self.available:
            return
        if self._stale and now >= self._reading_since + _PATIENCE:
            self._reading_since = now
            self._requests += 1
            number = self._requests
            self._client.list_parameters(callback=lambda future: self._listed(number, future))
        if self._wanted and now >= self._setting_since + _PATIENCE:
            self._setting_since = now
            wanted, self._wanted = self._wanted, {}
            parameters = [Parameter(name, value=value) for name, value in wanted.items()]
            self._client.set_parameters(
                parameters, callback=lambda future: self._were_set(list(wanted), future)
            )

    def follow(self, event: ParameterEvent) -> None:
        """Take the values of an event of the other node."""
        if event.new_parameters or event.deleted_parameters:
            self.refresh()
        for parameter in event.changed_parameters:
            self.values[parameter.name] = parameter_value_to_python(parameter.value)
            self.revision += 1

    def _listed(self, number: int, future: Future) -> None:
        if number != self._requests or future.result() is None:
            return
        names = list(future.result().result.names)[:_MOST]
        self._client.get_parameters(
            names, callback=lambda values: self._read(number, names, values)
        )
        self._client.describe_parameters(names, callback=self._described)

    def _read(self, number: int, names: list[str], future: Future) -> None:
        if number != self._requests or future.result() is None:
            return
        values = map(parameter_value_to_python, future.result().values)
        self.values = dict(zip(names, values, strict=False))
        self._stale = False
        self.revision += 1

    def _described(self, future: Future) -> None:
        if future.result() is None:
            return
        for each in future.result().descriptors:
            limits = f'; {each.additional_constraints}' if each.additional_constraints else ''
            self.descriptions[each.name] = each.description + limits
        self.revision += 1

    def _were_set(self, names: list[str], future: Future) -> None:
        self._setting_since = -_PATIENCE
        if future.result() is None:
            return
        for name, result in zip(names, future.result().results, strict=False):
            if not result.successful:
                self._refused(result.reason or f'{name} was refused')
                self.revision += 1  # controls return to the present value
