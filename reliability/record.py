"""The rows of docs/reliability.md: what was promised, and what was measured."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from cloth_ros.tradeoff.machine import describe

RESULTS = Path('docs/reliability')


@dataclass(frozen=True)
class Row:
    """
    One case.

    Attributes
    ----------
    what
        The fault, the extreme or the input.
    promised
        What is to happen; nothing where the case is there for comparison.
    measured
        What did, in figures.
    kept
        True if the promise was kept.

    """

    what: str
    promised: str
    measured: str
    kept: bool


def write(name: str, command: str, title: str, summary: str, rows: Sequence[Row]) -> bool:
    """
    Print rows and write them to docs/reliability/NAME.json; return whether all was kept.

    Parameters
    ----------
    name
        Of the file.
    command
        That makes it, as a user types it.
    title
        Of the table.
    summary
        What was tried, in a line of the README.
    rows
        Its cases.

    """
    RESULTS.mkdir(parents=True, exist_ok=True)
    content = {
        'title': title,
        'summary': summary,
        'command': command,
        'machine': describe(),
        'rows': [asdict(row) for row in rows],
    }
    path = RESULTS / f'{name}.json'
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')
    for row in rows:
        print(f'{"kept  " if row.kept else "BROKEN"} {row.what}: {row.measured}', flush=True)
    return all(row.kept for row in rows)
