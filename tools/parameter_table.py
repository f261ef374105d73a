"""
The table of parameters in the README, made from the scene.

    python -m tools.parameter_table
"""

from __future__ import annotations

from typing import Any

from cloth_ros import Scene
from cloth_ros.scene.parameter import PARAMETERS


def _yaml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        quoted = (f'"{item}"' if isinstance(item, str) else f'{item:g}' for item in value)
        return f'[{", ".join(quoted)}]'
    return f'{value:g}' if isinstance(value, float) else str(value)


def parameter_table() -> str:
    """Return the table in Markdown: name, default, unit, range, meaning."""
    lines = ['| parameter | default | unit | range | |', '| --- | --- | --- | --- | --- |']
    for name, value in Scene().flat().items():
        known = PARAMETERS[name]
        allowed = known.range_text.removesuffix(known.unit).rstrip()
        if known.choices:
            allowed = ', '.join(f'`{choice}`' for choice in known.choices)
        text = known.text + (' (fixed)' if known.fixed else '')
        lines.append(f'| `{name}` | `{_yaml(value)}` | {known.unit} | {allowed} | {text} |')
    return '\n'.join(lines)


if __name__ == '__main__':
    print(parameter_table())
