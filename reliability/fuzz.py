"""
Bad input of every kind, to every place that takes some.

    python -m reliability.fuzz [--cases 100000]

Each case must end in a clear error, in a refusal that is counted, or in a valid result; in no
other exception, no traceback, no warning of NumPy, and not at all never.  The cases are the same
ones in each run.  Fewer than a hundred thousand are not written to docs/reliability.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator

from . import fuzz_commands, fuzz_files, fuzz_services, fuzz_topics, fuzz_values
from .live import live
from .record import Row, broken, write
from .tally import Tally

# Shares of the cases; processes are dear, and get as many as there is time for.
_PARAMETERS, _COMMANDS, _FILES = 0.2, 0.05, 0.2
_MESSAGES, _CORRUPTED, _REQUESTS, _QUESTIONS, _STUDY = 0.32, 0.1, 0.06, 0.03, 0.03
_CLOCKS = 0.01
_STARTS = 1e-3
_CASES = 100_000  # of a full run


def in_python(cases: int) -> Iterator[Tally]:
    """Fuzz what needs no node."""
    yield fuzz_values.parameters(round(_PARAMETERS * cases))
    yield fuzz_values.commands(round(_COMMANDS * cases))
    yield fuzz_files.files(round(_FILES * cases))
    yield fuzz_files.paths()
    yield fuzz_commands.study(round(_STUDY * cases))


def live_node(cases: int) -> Iterator[Tally]:
    """Fuzz one node with all that comes over the graph; it must be well afterwards."""
    with live(*fuzz_topics.SCENE) as running:
        yield fuzz_topics.messages(running, round(_MESSAGES * cases))
        yield fuzz_topics.corrupted(running, round(_CORRUPTED * cases))
        yield fuzz_topics.clocks(running, round(_CLOCKS * cases))
        yield fuzz_services.questions(running, round(_QUESTIONS * cases))
        yield fuzz_services.parameters(running, round(_REQUESTS * cases))
        tally = Tally('the same node, after all of this', 'full rate and real time again')
        if 'Traceback' in running.node.output:
            tally.blame('a traceback', running.node.output[-1000:])
        fuzz_services.restore(running)
        tally.accepted += 1
        yield tally


def tallies(cases: int) -> Iterator[Tally]:
    """Fuzz everything, with about so many cases together."""
    yield from in_python(cases)
    yield from live_node(cases)
    yield fuzz_commands.node(round(_STARTS * cases))


def main() -> int:
    """Fuzz, and write the rows; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--cases', type=int, default=_CASES, help='about how many, together')
    arguments = parser.parse_args()
    rows: list[Row] = []
    total, start = 0, time.monotonic()
    what, promised = 'all of it', 'no case unaccounted for'
    try:
        for tally in tallies(arguments.cases):
            rows.append(tally.row())
            total += tally.cases
            seconds = time.monotonic() - start
            print(f'{rows[-1].what}: {rows[-1].measured}, {seconds:.0f} s', flush=True)
        every = all(row.kept for row in rows)
        rows.append(Row(what, promised, f'{total:,} cases', every))
    except Exception as error:
        rows.append(broken(what, promised, error))
    summary = (
        f'{total:,} inputs, good and bad: parameters, files, messages, bytes, requests and '
        'command lines'
    )
    full = arguments.cases >= _CASES
    return 0 if write('fuzz', 'make fuzz', 'Bad input', summary, rows, full=full) else 1


if __name__ == '__main__':
    sys.exit(main())
