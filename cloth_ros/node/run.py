"""The node made, spun and ended."""

from __future__ import annotations

import sys

import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from ..interrupt import Stop
from . import command_line, log_folder, shared_memory
from .cloth_node import ClothNode
from .executor import make_executor

_STOP_WITHIN = 0.25  # s, between two looks at whether a signal asked to stop


def run(stop: Stop, args: list[str] | None) -> None:
    """
    Make the node and spin it until `stop` asks.

    Raises
    ------
    SystemExit
        The node cannot be made; its text says why.

    """
    node: ClothNode | None = None
    try:
        # rclpy's own handlers would end the context in the middle of a tick.
        try:
            unwritable = log_folder.obstacle()
            given = sys.argv[1:] if args is None else args
            command_line.check_files(given)
            # Logs are worth less than the cloth.
            all_args = [*given, *log_folder.WITHOUT_FILES] if unwritable else given
            shared_memory.enlarge_shared_memory()
            rclpy.init(args=all_args, signal_handler_options=SignalHandlerOptions.NO)
            command_line.check_rest(given)
            executor = make_executor()
            node = ClothNode(stop)
            if unwritable:
                node.get_logger().warning(f'no log file: {unwritable}; set ROS_LOG_DIR')
        except (ValueError, RuntimeError) as error:  # of the scene, of rcl reading its file
            raise SystemExit(command_line.complaint(error)) from None
        executor.add_node(node)
        stop.defer()
        while not stop.asked:
            executor.spin_once(timeout_sec=_STOP_WITHIN)
    finally:
        stop.defer()
        if node is not None:
            node.destroy_node()
        try_shutdown()
