"""Warn of other nodes with the same name, which publish to the same topics."""

from __future__ import annotations

from rclpy.clock import Clock
from rclpy.node import Node

_PERIOD = 1.0  # s, from one check to the next


class DuplicateNames:
    """
    Warn when a node with the same name appears on the ROS graph.

    Parameters
    ----------
    node
        The node that is to be unique.
    clock
        Clock of the checks, which does not stand still.

    """

    def __init__(self, node: Node, clock: Clock) -> None:
        self._node = node
        self._known = 0
        node.create_timer(_PERIOD, self._check, clock=clock)

    def _check(self) -> None:
        node = self._node
        names = node.get_node_names_and_namespaces()
        others = names.count((node.get_name(), node.get_namespace())) - 1
        others = max(others, 0)  # the node may not have discovered itself yet
        if others > self._known:
            node.get_logger().warning(
                f'there is another node called {node.get_fully_qualified_name()}: both publish '
                'to the same topics, and either may answer a service; start one in another '
                'namespace, or rename it, with -r __ns:=/other or -r __node:=other'
            )
        self._known = others
