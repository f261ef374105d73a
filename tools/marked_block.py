"""Text in a page that a command writes, between two marks that a person has set."""

from __future__ import annotations

from pathlib import Path


def marks(name: str) -> tuple[str, str]:
    """Return the marks around what the command `name` writes."""
    return f'<!-- {name}: begin -->', f'<!-- {name}: end -->'


def fill(page: Path, name: str, text: str) -> None:
    """
    Replace what stands between the marks of a command.

    Raises
    ------
    ValueError
        The page has not just one pair of them.

    """
    begin, end = marks(name)
    before, rest = page.read_text(encoding='utf-8').split(begin)
    _, after = rest.split(end)
    page.write_text(f'{before}{begin}\n{text.strip()}\n{end}{after}', encoding='utf-8')
