"""The command `cloth_node`: signals first, everything heavy after."""

from __future__ import annotations

import gc
import os
import signal
import sys
from contextlib import suppress
from typing import NoReturn

from ..interrupt import Stop


def main(args: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    stop = Stop(signal.SIGINT, signal.SIGTERM)
    try:
        from .run import run

        run(stop, args)
    except BaseException as error:
        return 0 if stop.asked else _explain(error)
    return 0


def _explain(error: BaseException) -> int:
    """Say in a line why there is no node, and return the exit code; raise what is no reason."""
    if isinstance(error, ModuleNotFoundError):
        print(
            f'cloth_node: there is no {error.name}; source ROS 2 Jazzy, or install its wheels: '
            "pip install 'cloth_ros[ros]'",
            file=sys.stderr,
        )
        return 2
    if isinstance(error, SystemExit):
        print(f'cloth_node: {error}', file=sys.stderr)
        return 2
    raise error


def command() -> NoReturn:
    """
    Run the node, and end the process.

    Not by Python's own end: it takes what they use from under threads that are compiling kernels,
    which now and then ended in a segmentation fault.
    """
    code = main()
    gc.collect()  # a node that was interrupted while it was made says goodbye
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # no one reads it, it is closed
            stream.flush()
    os._exit(code)


if __name__ == '__main__':
    command()
