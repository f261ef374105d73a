"""Progress bar of the commands for recordings."""

from __future__ import annotations

from ..interrupt import StopSignal


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
