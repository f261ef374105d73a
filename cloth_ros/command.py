"""What commands share: errors of one line, exit codes, and the end by Ctrl-C."""

from __future__ import annotations

import argparse
import logging
import re
import signal
import sys
from collections.abc import Callable
from typing import Any, NoReturn

from .interrupt import StopSignal

_NEGATIVE = re.compile(r'-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$|-(inf|nan)$')


class Parser(argparse.ArgumentParser):
    """Argument parser with error messages of one line, which takes -1e-1 for a number."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        # That of Python 3.11 takes it for an option.
        self._negative_number_matcher = _NEGATIVE

    def error(self, message: str) -> NoReturn:
        """Print the error in one line and exit with code 2."""
        self.exit(2, f'{self.prog}: {message}; see {self.prog} --help\n')


def run_command(name: str, extra: str, run: Callable[[StopSignal], int], *, stopped: str) -> int:
    """
    Run a command until it ends or Ctrl-C comes, and print an error in one line.

    Parameters
    ----------
    name
        Of the command.
    extra
        Of the package, which installs the libraries that it needs.
    run
        What it does; returns the exit code.
    stopped
        What remains after Ctrl-C, in words.

    Returns
    -------
    int
        The exit code: that of `run`, 2 for an error, 130 for Ctrl-C.

    """
    stop = StopSignal(signal.SIGINT)
    try:
        return run(stop)
    except BaseException as error:
        if stop.requested:
            logging.disable()  # Dask logs each request that the end cuts off
            print(f'\n{name}: stopped; {stopped}', file=sys.stderr)
            return 130
        if isinstance(error, ModuleNotFoundError):
            reason = f"{error.name} is not installed; pip install 'cloth_ros[{extra}]'"
        elif isinstance(error, (ValueError, OSError)):
            reason = str(error)
        else:
            raise
        print(f'{name}: {reason}', file=sys.stderr)
        return 2
    finally:
        stop.restore()
