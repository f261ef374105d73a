"""
The tables of docs/reliability.md and the README, from what the commands here have measured.

    python -m reliability.report
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from cloth_ros.tradeoff.report import table
from tools.marked_block import fill

from .record import RESULTS

PAGE = Path('docs/reliability.md')
_ORDER = ('torture', 'extremes', 'fuzz', 'faults', 'soak')


def section(result: dict[str, Any]) -> str:
    """Return the table of a command, below its title."""
    machine = result['machine']
    rows = [
        (row['what'], row['promised'], ('' if row['kept'] else '**not kept:** ') + row['measured'])
        for row in result['rows']
    ]
    return f"""## {result['title']}

`{result['command']}`, of commit {result.get('commit', 'unknown')}, on: \
{machine['processor']}, {machine['vector instructions']}, {machine['cores']} cores, \
Python {machine['python']}.

{table(('what', 'promised', 'measured'), rows)}
"""


def summary(results: list[dict[str, Any]]) -> str:
    """Return a line for each command."""
    lines = []
    for result in results:
        promises = [row['kept'] for row in result['rows'] if row['promised']]
        kept = f'{sum(promises)} of {len(promises)}'
        lines.append((f'`{result["command"]}`', result['summary'], kept))
    return table(('command', 'tries', 'promises kept'), lines)


def main() -> None:
    """Write the tables."""
    paths = [RESULTS / f'{name}.json' for name in _ORDER]
    results = [json.loads(path.read_text(encoding='utf-8')) for path in paths if path.exists()]
    fill(PAGE, 'make reliability', '\n'.join(section(result) for result in results))
    fill(Path('README.md'), 'make reliability', summary(results))
    print(PAGE)


if __name__ == '__main__':
    main()
