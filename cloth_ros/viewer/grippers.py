"""The grippers of a cloth: their services, and what they hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from std_srvs.srv import SetBool

from .discovery import ClothName


class GripperClients:
    """
    Let grippers grasp and release.

    Parameters
    ----------
    node
        Owner of the clients.
    name
        Of the cloth.
    report
        Called with a text for the user.

    """

    def __init__(self, node: Node, name: ClothName, report: Callable[[str], None]) -> None:
        self._node, self._name, self._report = node, name, report
        self._clients: dict[str, Client] = {}
        self._held: dict[str, int] = {}

    @property
    def names(self) -> list[str]:
        """Names of the grippers."""
        return list(self._clients)

    def follow(self, names: Sequence[str]) -> None:
        """Take the grippers that there are."""
        for name in self._clients.keys() - set(names):
            self._node.destroy_client(self._clients.pop(name))
        for name in names:
            if name not in self._clients:
                service = self._name.resolve(f'{name}/grasp')
                self._clients[name] = self._node.create_client(SetBool, service)

    def take(self, values: dict[str, str]) -> None:
        """Take the numbers of held particles from diagnostics."""
        for name in self._clients:
            text = values.get(f'{name} held particles', '')
            self._held[name] = int(text) if text.isdecimal() else 0

    def held(self, name: str) -> int:
        """Return the number of particles that a gripper held last."""
        return self._held.get(name, 0)

    def toggle(self, name: str) -> None:
        """Let a gripper release what it holds, or grasp if it holds nothing."""
        client = self._clients.get(name)
        if client is None or not client.service_is_ready():
            return
        closes = not self.held(name)

        def answered(future: Any) -> None:
            answer = future.result()
            if not answer.success:
                self._report(answer.message)
            else:  # until the next diagnostics
                counts = [int(word) for word in answer.message.split() if word.isdecimal()]
                self._held[name] = counts[-1] if closes and counts else 0

        client.call_async(SetBool.Request(data=closes)).add_done_callback(answered)
