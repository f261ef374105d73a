"""Generated parts of a Markdown page: replace the text between two marks."""

from __future__ import annotations

from pathlib import Path


def marks(name: str) -> tuple[str, str]:
    """Return the marks around the text that the command `name` generates."""
    return f'<!-- {name}: begin -->', f'<!-- {name}: end -->'


def fill(page: Path, name: str, text: str) -> None:
    """
    Replace the text between the marks of a command.

    Parameters
    ----------
    page
        Markdown file, which contains one pair of marks.
    name
        Command, as in the marks.
    text
        New text.

    Raises
    ------
    ValueError
        The page does not contain exactly one pair of marks.

    """
    begin, end = marks(name)
    before, rest = page.read_text(encoding='utf-8').split(begin)
    _, after = rest.split(end)
    page.write_text(f'{before}{begin}\n{text.strip()}\n{end}{after}', encoding='utf-8')
