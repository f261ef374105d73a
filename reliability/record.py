"""The rows of docs/reliability.md: what was promised, and what was measured."""

from __future__ import annotations

import json
import subprocess
import traceback
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from cloth_ros.scene.parameter import format_error
from cloth_ros.tradeoff.machine import describe

RESULTS = Path('docs/reliability')
_ROOT = Path(__file__).parent.parent
# What results are written to, which does not change what they were measured on.
_PAGES = (':!docs', ':!README.md')
_LONGEST = 500  # characters of an error


def _git(*arguments: str) -> str:
    command = ['git', '-C', str(_ROOT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def _commit() -> str:
    """Return the commit of the working tree, with a plus if it was changed since."""
    try:
        changed = _git('status', '--porcelain', '--', '.', *_PAGES)
        return _git('rev-parse', '--short', 'HEAD') + ('+' if changed else '')
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'


# That of the beginning: some runs take an hour.
_COMMIT = _commit()


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


def broken(what: str, promised: str, error: Exception) -> Row:
    """Return the row of what has ended in an error, and print where that was."""
    traceback.print_exception(error)
    text = format_error(error).replace('|', '/')  # in a table
    return Row(what, promised, text[:_LONGEST], kept=False)


def write(
    name: str, command: str, title: str, summary: str, rows: Sequence[Row], *, full: bool = True
) -> bool:
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
    full
        False if less was tried than the command does by itself: then nothing is written.

    """
    for row in rows:
        print(f'{"kept  " if row.kept else "BROKEN"} {row.what}: {row.measured}', flush=True)
    kept = all(row.kept for row in rows)
    if not full:
        print('nothing is written: this was no full run')
        return kept
    RESULTS.mkdir(parents=True, exist_ok=True)
    content = {
        'title': title,
        'summary': summary,
        'command': command,
        'machine': describe(),
        'commit': _COMMIT,
        'rows': [asdict(row) for row in rows],
    }
    path = RESULTS / f'{name}.json'
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')
    return kept
