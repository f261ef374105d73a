"""Make the node and the page, and serve both until a signal is received."""

from __future__ import annotations

import time

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from ..executor import make_executor
from ..interrupt import StopSignal
from .actions import Actions
from .cloth_client import ClothClient
from .discovery import ClothName, find_cloths
from .options import Options
from .page import Page

_FRAME = 1 / 32  # s, from one picture to the next
_UPDATE = 0.25  # s, from one update of texts and controls to the next
_SEARCH = 1.0  # s, from one search for cloths to the next


class Viewer:
    """
    Find cloths and show them.

    Parameters
    ----------
    node
        Talks to the cloths.
    page
        Shows them.
    actions
        What users do.

    """

    def __init__(self, node: Node, page: Page, actions: Actions) -> None:
        self._node, self._page, self._actions = node, page, actions
        self._clients: dict[ClothName, ClothClient] = {}
        self._next_frame = self._next_update = self._next_search = 0.0

    @property
    def patience(self) -> float:
        """Time until something is due, s."""
        return max(self._next_frame - time.monotonic(), 0.0)

    def turn(self) -> None:
        """Do what is due."""
        now = time.monotonic()
        if now < self._next_frame:
            return
        self._next_frame = max(self._next_frame + _FRAME, now)
        self._actions.run()
        if now >= self._next_search:
            self._next_search = now + _SEARCH
            self._search()
        if now >= self._next_update:
            self._next_update = now + _UPDATE
            for client in self._clients.values():
                client.update()
            self._page.update()
        self._page.draw()

    def _search(self) -> None:
        for name in find_cloths(self._node):
            if name not in self._clients:
                self._node.get_logger().info(f'showing {name.node}')
                client = ClothClient(self._node, name, self._report)
                self._clients[name] = client
                self._page.add(client)

    def _report(self, text: str) -> None:
        self._node.get_logger().warning(f'refused: {text}')
        self._page.notify(text)


def run(stop: StopSignal, options: Options) -> None:
    """
    Serve the page until a signal is received.

    Raises
    ------
    RuntimeError
        rcl rejects the ROS arguments.

    """
    node: Node | None = None
    page: Page | None = None
    try:
        rclpy.init(args=options.ros_arguments, signal_handler_options=SignalHandlerOptions.NO)
        node = Node('cloth_viewer')
        actions = Actions()
        domain = node.context.get_domain_id()
        page = Page(options.host, options.port, domain, actions)
        node.get_logger().info(f'open {options.address} in a browser; Ctrl-C ends the viewer')
        viewer = Viewer(node, page, actions)
        executor = make_executor()
        executor.add_node(node)
        stop.defer()
        while not stop.requested:
            executor.spin_once(timeout_sec=viewer.patience)
            viewer.turn()
    finally:
        stop.defer()
        if page is not None:
            page.stop()
        if node is not None:
            node.destroy_node()
        try_shutdown()
