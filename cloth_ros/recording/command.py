"""What the commands for recordings share: errors of one line, progress, and the end by Ctrl-C."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
from collections.abc import Callable
from typing import NoReturn

from ..interrupt import StopSignal


class Parser(argparse.ArgumentParser):
    """Argument parser with error messages of one line."""

    def error(self, message: str) -> NoReturn:
        """Print the error in one line and exit with code 2."""
        self.exit(2, f'{self.prog}: {message}; see {self.prog} --help\n')


class ProgressBar:
    """
    Progress bar with the time that is left; each call also checks for Ctrl-C.

    Parameters
    ----------
    stop
        Signals that end the command.
    unit
        What is counted.

    """

    def __init__(self, stop: StopSignal, unit: str) -> None:
        from tqdm import tqdm

        self._stop = stop
        self._bar = tqdm(unit=unit, disable=None, leave=False)

    def __call__(self, done: int, total: int) -> None:
        """Show how many are done, of how many; 0: unknown."""
        self._stop.check()
        if total and self._bar.total != total:
            self._bar.total = total
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Remove the bar."""
        self._bar.close()


def run_command(name: str, extra: str, run: Callable[[StopSignal], int]) -> int:
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
            print(f'\n{name}: stopped; what was written is complete', file=sys.stderr)
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
