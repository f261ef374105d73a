"""Many bags on Dask: each is a task, on this machine or on a cluster that sees the same files."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from ..interrupt import StopSignal
from .resimulation import Settings
from .run import Outcome, repeat, resimulate


def process(path: Path, node: str | None, settings: Settings | None, folder: Path) -> Outcome:
    """Repeat a bag, or simulate it again; an error becomes the outcome."""
    try:
        if settings is None:
            return repeat(path, node, lambda *_: None)
        return resimulate(path, node, settings, folder, lambda *_: None)
    except (ValueError, OSError) as error:
        return Outcome([str(error)], False, {'bag': str(path), 'error': str(error)})


def on_dask(
    paths: Sequence[Path],
    node: str | None,
    settings: Settings | None,
    folder: Path,
    scheduler: str | None,
    stop: StopSignal,
) -> Iterator[tuple[Path, Outcome]]:
    """
    Yield each bag and what became of it, as it ends.

    Parameters
    ----------
    paths
        Of the bags; the workers must see them under the same names.
    node, settings
        See `run.resimulate`; without settings the bags are repeated.
    folder
        Where to write: a folder for each bag.
    scheduler
        Address of a cluster; None: one process for each core of this machine.
    stop
        Signals, which are polled while workers start.

    Raises
    ------
    OSError
        There is no such cluster.

    """
    from distributed import Client, LocalCluster, as_completed

    with ExitStack() as stack:
        with stop.deferred():
            if scheduler is None:
                cluster = LocalCluster(threads_per_worker=1, dashboard_address=None)
                stack.enter_context(cluster)
            client = stack.enter_context(Client(scheduler or cluster))
        tasks = {
            client.submit(process, path, node, settings, folder / path.name, pure=False): path
            for path in paths
        }
        try:
            for future, outcome in as_completed(tasks, with_results=True):
                yield tasks.pop(future), outcome
                future.release()
        except BaseException:
            if stop.requested:
                logging.disable()  # Dask logs each of its requests that the end cuts off
            raise
