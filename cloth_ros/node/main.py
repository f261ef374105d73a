"""The command `cloth_node`: signals first, everything heavy after."""

from __future__ import annotations

import gc
import os
import signal
import sys
from contextlib import suppress
from types import FrameType
from typing import NoReturn


class Interrupt(BaseException):
    """
    A signal asks to stop.

    Not KeyboardInterrupt: where one passes through `exec`, which Numba uses, Python ends itself by
    SIGINT although it was caught.
    """


class Stop:
    """
    What SIGINT and SIGTERM ask for.

    They raise `Interrupt` while the node is being made, which may take long; after that they only
    leave word.

    Attributes
    ----------
    asked
        True once a signal has come.

    """

    def __init__(self) -> None:
        self.asked = False
        self._raising = True
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)

    def _ask(self, _: int, __: FrameType | None) -> None:
        self.asked = True
        if self._raising:
            self._raising = False
            raise Interrupt

    def defer(self) -> None:
        """Raise no longer, from here on."""
        self._raising = False


def main(args: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    stop = Stop()
    try:
        from .run import run

        run(stop, args)
    except BaseException as error:
        # On its way up an interrupt may become something else: an import makes it ImportError.
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
