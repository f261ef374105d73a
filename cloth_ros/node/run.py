"""Make the node, spin it until a signal is received, and destroy it."""

from __future__ import annotations

import sys

import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from ..executor import make_executor
from ..interrupt import StopSignal
from . import command_line, log_folder, shared_memory
from .cloth_node import ClothNode
from .parameter_arguments import ParameterArguments

_POLL = 0.25  # s, from one check for a signal to the next


def run(stop: StopSignal, args: list[str] | None) -> None:
    """
    Make the node and spin it until a signal is received.

    Raises
    ------
    SystemExit
        The node cannot be made; its text says why.

    """
    node: ClothNode | None = None
    try:
        # rclpy's own signal handlers would end the context in the middle of a tick.
        try:
            unwritable = log_folder.obstacle()
            given = sys.argv[1:] if args is None else args
            with ParameterArguments(given) as parameters:
                # Without log files rather than not at all.
                extra = log_folder.WITHOUT_FILES if unwritable else ()
                shared_memory.enlarge_shared_memory()
                rclpy.init(
                    args=[*parameters.arguments, *extra],
                    signal_handler_options=SignalHandlerOptions.NO,
                )
                command_line.check_rest(parameters.arguments)
            executor = make_executor()
            try:
                node = ClothNode(stop)
            except ValueError as error:
                raise ValueError(parameters.located(error)) from None
            if unwritable:
                node.get_logger().warning(f'no log file: {unwritable}; set ROS_LOG_DIR')
            for line in parameters.files_for_others(node.get_fully_qualified_name()):
                node.get_logger().warning(line)
        except (ValueError, RuntimeError) as error:  # of the scene, of rcl reading its file
            raise SystemExit(command_line.explanation(error)) from None
        executor.add_node(node)
        stop.defer()
        while not stop.requested:
            executor.spin_once(timeout_sec=_POLL)
    finally:
        stop.defer()
        if node is not None:
            node.destroy_node()
        try_shutdown()
