"""
What the running node outlives, on real processes.

    python -m reliability.faults [--quick] [--only NAME ...]

Each fault is a function that makes it, waits until the node is well again, and returns what was
promised and measured; `test/test_faults.py` runs the same ones, shorter.  Times that no promise
names are figures: they are those of a machine that may be busy with other things.  Only all faults
at full length are written to docs/reliability.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator

from ..live import live
from ..record import Row, broken, write
from . import ALONE, SCENE, SHARED
from .cannot import CannotDoError

_WELL = 'that a node is well again'


def tried(fault: Callable[..., Row], *arguments: object) -> Row:
    """Make a fault; one that cannot be made here, or ends in an error, is a promise not kept."""
    print(f'{fault.__name__} …', flush=True)
    what = (fault.__doc__ or '').rstrip('.')
    try:
        return fault(*arguments)
    except CannotDoError as reason:
        return Row(what, _WELL, f'not tried here: {reason}', kept=False)
    except Exception as error:
        return broken(what, _WELL, error)


def rows(only: list[str], quick: bool) -> Iterator[Row]:
    """Make the faults, one after the other."""
    shared = [fault for fault in SHARED if not only or fault.__name__ in only]
    try:
        if shared:
            with live(*SCENE) as running:
                for fault in shared:
                    yield tried(fault, running, quick)
    except AssertionError as error:
        yield broken('a node for the faults', 'that it starts', error)
    for alone in ALONE:
        if not only or alone.__name__ in only:
            yield tried(alone, quick)


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
    title, full = 'Faults of the running node', not (arguments.only or arguments.quick)
    return 0 if write('faults', 'make faults', title, summary, found, full=full) else 1


if __name__ == '__main__':
    sys.exit(main())
