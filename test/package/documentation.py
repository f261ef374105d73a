"""The blocks of code in the documentation, and how each is run."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from builders import ROOT

PAGES = sorted([ROOT / 'README.md', *(ROOT / 'docs').rglob('*.md')])
# A comment of HTML in the line before a block, which readers do not see, and the block.
_BLOCK = re.compile(
    r'^(?: *<!-- (?P<how>(?:not )?run: [^\n]*) -->\n)?(?P<indent> *)```(?P<kind>\S*)[^\n]*\n'
    r'(?P<text>.*?)\n(?P=indent)```$',
    re.MULTILINE | re.DOTALL,
)
_PART = re.compile(
    r'with (?P<scene>config/\w+\.yaml)|until "(?P<until>[^"]+)"|for (?P<seconds>\d+) s'
    r'|needs (?P<needs>\w+)'
)


class Block(NamedTuple):
    """
    A block of code.

    Attributes
    ----------
    page, line
        Where it begins.
    kind
        Language.
    text
        Code.
    scene
        Scene of a node that runs meanwhile; None: there is no node.
    until, seconds
        Ctrl-C comes when the code has printed the text, or after s; None: it ends by itself.
    needs
        Command or ROS package without which it is skipped, because it is not on PyPI.
    reason
        Why it is not run; None: it is.

    """

    page: Path
    line: int
    kind: str
    text: str
    scene: str | None = None
    until: str | None = None
    seconds: int | None = None
    needs: str | None = None
    reason: str | None = None

    @property
    def name(self) -> str:
        """The place, for the name of a test."""
        return f'{self.page.relative_to(ROOT)}:{self.line}'


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a page; raises ValueError for a comment that means nothing."""
    text, found = page.read_text(), []
    for match in _BLOCK.finditer(text):
        line = text.count('\n', 0, match.start('kind')) + 1
        code = re.sub(f'^{match["indent"]}', '', match['text'], flags=re.MULTILINE)
        found.append(Block(page, line, match['kind'], code, **_settings(match['how'] or '')))
    return found


def _settings(how: str) -> dict[str, object]:
    if how.startswith('not run: '):
        return {'reason': how.removeprefix('not run: ')}
    result: dict[str, object] = {}
    for part in how.removeprefix('run: ').split(', ') if how else ():
        match = _PART.fullmatch(part)
        if match is None:
            raise ValueError(f'{part!r} says nothing about how a block is run')
        result.update({name: value for name, value in match.groupdict().items() if value})
    if 'seconds' in result:
        result['seconds'] = int(str(result['seconds']))
    return result
