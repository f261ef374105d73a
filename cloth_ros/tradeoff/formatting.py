"""Numbers and tables of reports in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = ['| ' + ' | '.join(head) + ' |', '|' + ' --- |' * len(head)]
    lines += ['| ' + ' | '.join(str(cell) for cell in row) + ' |' for row in rows]
    return '\n'.join(lines)


def length(metres: float) -> str:
    """Return a length in m, mm, µm or nm."""
    for unit, size, least in (('m', 1.0, 1.0), ('mm', 1e-3, 1e-4), ('µm', 1e-6, 1e-7)):
        if metres >= 0.999 * least:
            return f'{metres / size:.3g} {unit}'
    return f'{metres / 1e-9:.3g} nm'


def percent(share: float) -> str:
    """Format a share in percent."""
    return f'{100 * share:.{3 if share >= 1 else 2}g} %'
