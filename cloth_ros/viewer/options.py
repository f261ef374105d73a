"""The command line of `cloth_viewer`."""

from __future__ import annotations

import argparse
import socket
from collections.abc import Sequence
from contextlib import ExitStack
from typing import NamedTuple

PORT = 8080
_DESCRIPTION = """\
Show running cloths in a browser, with controls: wind, colliders to drag, pause, reset, stiffness,
friction, and live plots.  The viewer finds every cloth on its ROS domain, also in namespaces, on
other machines, or played from a recording.
"""
_EPILOG = """\
examples:
  cloth_viewer
  cloth_viewer --port 8090 --ros-args -r __ns:=/lab
  cloth_viewer --host 0.0.0.0      # whoever reaches this machine can see and command the cloths

documentation: section "Browser view" of the README of cloth_ros
"""


class Options(NamedTuple):
    """
    What the command line says.

    Attributes
    ----------
    host, port
        Address to listen on.
    ros_arguments
        For rcl.

    """

    host: str
    port: int
    ros_arguments: list[str]

    @property
    def address(self) -> str:
        """Address of the page for a browser on this machine."""
        host = {'0.0.0.0': 'localhost', '::': 'localhost'}.get(self.host, self.host)
        return f'http://{f"[{host}]" if ":" in host else host}:{self.port}'


def _port(text: str) -> int:
    if text.isascii() and text.isdigit() and int(text) <= 65535:
        return int(text)
    raise argparse.ArgumentTypeError(
        f'is {text!r}, but must be a number from 0 (any free port) to 65535; write --port {PORT}'
    )


def parse(arguments: Sequence[str]) -> Options:
    """
    Return what a command line says.

    Raises
    ------
    SystemExit
        It says what does not exist, or asks for help.

    """
    parser = argparse.ArgumentParser(
        'cloth_viewer',
        usage='cloth_viewer [--host HOST] [--port PORT] [--ros-args …]',
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        '--host', default='localhost', help='address to listen on (default: this machine only)'
    )
    parser.add_argument(
        '--port', type=_port, default=PORT, help=f'0: any free one (default: {PORT})'
    )
    own, ros = _split(arguments)
    options = parser.parse_args(own)
    return Options(options.host, options.port, ros)


def _split(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the arguments for the viewer, and those for ROS."""
    own: list[str] = []
    ros: list[str] = []
    target = own
    for argument in arguments:
        if argument == '--ros-args':
            target = ros
        target.append(argument)
        if argument == '--':
            target = own
    return own, ros


def free_address(options: Options) -> Options:
    """
    Return the options with a port that is free on the host.

    Raises
    ------
    ValueError
        There is no such host on this machine, or another program uses the port.

    """
    try:
        found = socket.getaddrinfo(options.host, options.port or None, type=socket.SOCK_STREAM)
    except OSError:
        raise ValueError(
            f'--host is {options.host!r}, but must be a name or an address of this machine; '
            'write --host localhost'
        ) from None
    port = options.port
    with ExitStack() as opened:
        for family, kind, protocol, _, address in found:
            listener = opened.enter_context(socket.socket(family, kind, protocol))
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if family == socket.AF_INET6:
                listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            try:
                listener.bind((address[0], port, *address[2:]))
            except OSError as error:
                raise ValueError(_why_not(options, error)) from None
            port = listener.getsockname()[1]
    return options._replace(port=port)


def _why_not(options: Options, error: OSError) -> str:
    if error.errno in (98, 13):  # in use, or not permitted
        reason = 'that no other program uses' if error.errno == 98 else 'above 1023'
        other = options.port + 1 if 1023 < options.port < 65535 else PORT + 10
        return f'--port is {options.port}, but must be one {reason}; write --port {other}'
    return (
        f'--host is {options.host!r}, but must be an address of this machine '
        f'({error.strerror}); write --host localhost'
    )
