"""The command `cloth_node`; it handles signals before it imports anything slow."""

from __future__ import annotations

import gc
import os
import signal
import sys
from contextlib import suppress
from typing import NoReturn

from ..interrupt import StopSignal


def main(args: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM, or print its usage; return the exit code."""
    stop = StopSignal(signal.SIGINT, signal.SIGTERM)
    if {'-h', '--help'} & set(sys.argv[1:] if args is None else args):
        from .usage import usage

        print(usage(), end='')
        return 0
    try:
        with stop.deferred():
            from .run import run
        run(stop, args)
    except BaseException as error:
        return 0 if stop.requested else _explain(error)
    return 0


def _explain(error: BaseException) -> int:
    """Print why there is no node, and return the exit code; raise what is not expected."""
    if isinstance(error, ModuleNotFoundError):
        remedy = "source ROS 2 Jazzy, or install its wheels: pip install 'cloth_ros[ros]'"
        if error.name in ('numba', 'msgspec'):  # which no distribution of ROS has
            remedy = f'pip install {error.name}'
        print(f'cloth_node: there is no {error.name}; {remedy}', file=sys.stderr)
        return 2
    if isinstance(error, SystemExit):
        print(f'cloth_node: {error}', file=sys.stderr)
        return 2
    raise error


def command() -> NoReturn:
    """
    Run the node, and end the process.

    Not by Python's own shutdown: it destroys what threads that compile or load kernels still use,
    which sometimes ended in a segmentation fault.
    """
    code = main()
    gc.collect()  # ends the ROS entities of a node whose construction was interrupted
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # closed, or without a reader
            stream.flush()
    os._exit(code)


if __name__ == '__main__':
    command()
