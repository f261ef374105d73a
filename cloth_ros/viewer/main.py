"""The command `cloth_viewer`; it handles signals before it imports anything slow."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import NoReturn

from ..interrupt import StopSignal

_LONGEST = 600  # characters of an explanation


def main(arguments: list[str] | None = None) -> int:
    """Serve the page until SIGINT or SIGTERM, or print the usage; return the exit code."""
    stop = StopSignal(signal.SIGINT, signal.SIGTERM)
    try:
        from .options import free_address, parse

        options = free_address(parse(sys.argv[1:] if arguments is None else arguments))
        with stop.deferred():
            from .run import run
        run(stop, options)
    except SystemExit as error:  # of the parser, which has printed why
        return int(error.code or 0)
    except BaseException as error:
        return 0 if stop.requested else _explain(error)
    return 0


def _explain(error: BaseException) -> int:
    """Print why there is no viewer, and return the exit code; raise what is not expected."""
    if isinstance(error, ModuleNotFoundError):
        extra = 'viewer' if error.name in ('viser', 'trimesh', 'numpy') else 'ros'
        text = f"there is no {error.name}; install it: pip install 'cloth_ros[{extra}]'"
        if extra == 'ros':
            text += ', or source ROS 2 Jazzy'
    elif isinstance(error, (ValueError, RuntimeError)):
        text = ' '.join(str(error).split())[:_LONGEST]
    else:
        raise error
    print(f'cloth_viewer: {text}', file=sys.stderr)
    return 2


def command() -> NoReturn:
    """
    Serve the page, and end the process.

    Not by Python's own shutdown, which waits for the threads of the page.
    """
    code = main()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # closed, or without a reader
            stream.flush()
    os._exit(code)


if __name__ == '__main__':
    command()
