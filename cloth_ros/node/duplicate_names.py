"""Other nodes of the same name, which would answer the same services and move the same cloth."""

from __future__ import annotations

from rclpy.clock import Clock
from rclpy.node import Node

_EVERY = 1.0  # s, between two looks


class DuplicateNames:
    """
    Warns when a node of the same name appears on the graph.

    Parameters
    ----------
    node
        Whose name it is.
    clock
        That does not stand still.

    """

    def __init__(self, node: Node, clock: Clock) -> None:
        self._node = node
        self._known = 0
        node.create_timer(_EVERY, self._look, clock=clock)

    def _look(self) -> None:
        node = self._node
        names = node.get_node_names_and_namespaces()
        others = names.count((node.get_name(), node.get_namespace())) - 1
        others = max(others, 0)  # it may not have found itself yet
        if others > self._known:
            node.get_logger().warning(
                f'there is another node called {node.get_fully_qualified_name()}: both publish '
                'to the same topics, and either may answer a service; start one in another '
                'namespace, or rename it, with -r __ns:=/other or -r __node:=other'
            )
        self._known = others
