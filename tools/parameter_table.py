"""
Table of all parameters in docs/parameters.md, generated from the scene.

    python -m tools.parameter_table
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cloth_ros import Scene
from cloth_ros.scene.parameter import MEMBERS, PARAMETERS, Declaration

from .marked_block import fill

_COMMAND = 'python -m tools.parameter_table'
_PAGE = Path(__file__).parent.parent / 'docs' / 'parameters.md'


def _yaml(value: Any) -> str:
    """Return a value as it is written in a scene file."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        quoted = (f'"{item}"' if isinstance(item, str) else f'{item:g}' for item in value)
        return f'[{", ".join(quoted)}]'
    return f'{value:g}' if isinstance(value, float) else str(value)


def parameter_table() -> str:
    """Return the table in Markdown: name, default, unit, range and meaning of each parameter."""
    lines = ['| parameter | default | unit | range | meaning |', '| --- | --- | --- | --- | --- |']
    for name, value in Scene().flat().items():
        lines.append(_row(name, Declaration(PARAMETERS[name], value)))
        group, _, last = name.rpartition('.')
        if group in MEMBERS and last == 'names':
            members = MEMBERS[group].items()
            lines += [_row(f'{group}.NAME.{field}', declared) for field, declared in members]
    return '\n'.join(lines)


def _row(name: str, declared: Declaration) -> str:
    known, default = declared
    allowed = known.range_text.removesuffix(known.unit).rstrip()
    if known.choices:
        allowed = ', '.join(f'`{choice}`' for choice in known.choices)
    text = known.text + (' (fixed)' if known.fixed else '')
    shown = '' if default == '' else f'`{_yaml(default)}`'
    return f'| `{name}` | {shown} | {known.unit} | {allowed} | {text} |'


if __name__ == '__main__':
    fill(_PAGE, _COMMAND, parameter_table())
