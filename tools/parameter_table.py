"""
Table of all parameters in docs/parameters.md, generated from the scene.

    python -m tools.parameter_table
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cloth_ros import Scene
from cloth_ros.scene.parameter import PARAMETERS

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
        known = PARAMETERS[name]
        allowed = known.range_text.removesuffix(known.unit).rstrip()
        if known.choices:
            allowed = ', '.join(f'`{choice}`' for choice in known.choices)
        text = known.text + (' (fixed)' if known.fixed else '')
        lines.append(f'| `{name}` | `{_yaml(value)}` | {known.unit} | {allowed} | {text} |')
    return '\n'.join(lines)


if __name__ == '__main__':
    fill(_PAGE, _COMMAND, parameter_table())
