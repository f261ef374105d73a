"""
What the running node outlives, on real processes.

    python -m reliability.faults [--quick] [--only NAME ...]

Each fault is a function that makes it, waits until the node is well again, and returns what was
promised and measured; `test/test_faults.py` runs the same ones, shorter.  Times are figures, not
promises: they are those of a machine that may be busy with other things.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator

from ..live import live
from ..record import Row, write
from . import ALONE, SCENE, SHARED
from .cannot import CannotDoError


def _tried(name: str, fault: Callable[[], Row]) -> Iterator[Row]:
    print(f'{name} …', flush=True)
    try:
        yield fault()
    except CannotDoError as reason:
        print(f'{name} cannot be done here: {reason}')
    except AssertionError as error:
        yield Row(name, 'that the node is well again', f'it is not: {error}', False)


def rows(only: list[str], quick: bool) -> Iterator[Row]:
    """Make the faults, one after the other."""
    shared = [fault for fault in SHARED if not only or fault.__name__ in only]
    if shared:
        with live(*SCENE) as running:
            for fault in shared:
                yield from _tried(fault.__name__, lambda: fault(running, quick))  # noqa: B023
    for alone in ALONE:
        if not only or alone.__name__ in only:
            yield from _tried(alone.__name__, lambda: alone(quick))  # noqa: B023


def main() -> int:
    """Make the faults, print and write what was measured; return 1 if a promise was broken."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--quick', action='store_true', help='in a tenth of the time')
    names = [fault.__name__ for fault in (*SHARED, *ALONE)]
    parser.add_argument('--only', nargs='+', choices=names, default=[], metavar='NAME')
    arguments = parser.parse_args()
    found = list(rows(arguments.only, arguments.quick))
    summary = (
        f'{len(found)} faults around a live node: stops, kills, clocks, subscribers, floods of '
        'commands, busy processors, network, logs, signals'
    )
    title = 'Faults of the running node'
    return 0 if write('faults', 'make faults', title, summary, found) else 1


if __name__ == '__main__':
    sys.exit(main())
