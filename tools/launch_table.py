"""
Table of the arguments of the launch file in docs/commands.md.

    python -m tools.launch_table

Read from its source: launch is not on PyPI.
"""

from __future__ import annotations

import ast
from pathlib import Path

from .marked_block import fill

_COMMAND = 'python -m tools.launch_table'
_ROOT = Path(__file__).parent.parent
_FILE = _ROOT / 'launch' / 'cloth.launch.py'


def launch_table() -> str:
    """Return the table in Markdown: name, default and meaning of each argument."""
    lines = ['| argument | default | meaning |', '| --- | --- | --- |']
    for node in ast.walk(ast.parse(_FILE.read_text())):
        if not isinstance(node, ast.Call) or ast.unparse(node.func) != 'DeclareLaunchArgument':
            continue
        given = {each.arg: each.value for each in node.keywords}
        default = 'false' if None in given else _text(given['default_value'])
        shown = f'`{default}`' if default else ''
        lines.append(f'| `{_text(node.args[0])}` | {shown} | {_text(given["description"])} |')
    return '\n'.join(lines)


def _text(value: ast.expr) -> str:
    """Return a string, or that of the parts of a path in this package."""
    if isinstance(value, ast.Constant):
        return str(value.value)
    parts = [each.value for each in ast.walk(value) if isinstance(each, ast.Constant)]
    return '/'.join(map(str, parts))


if __name__ == '__main__':
    fill(_ROOT / 'docs' / 'commands.md', _COMMAND, launch_table())
