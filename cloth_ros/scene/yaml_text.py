"""
Values as text: YAML of them, and what numbers, booleans and lists that arrive as text mean.

ROS delivers some values as text: ``ros2 param set`` sends ``1e-4`` and lists that mix integers and
floats as strings.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

NUMBER = re.compile(r'[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?')
_WORDS = {
    **dict.fromkeys(('true', 'yes', 'on', 'y'), True),
    **dict.fromkeys(('false', 'no', 'off', 'n'), False),
}


def parse_number(text: str) -> float | None:
    """Return the number that a text is, as int where it is written so; None: it is none."""
    text = text.strip()
    if not NUMBER.fullmatch(text):
        return None
    try:
        return int(text)
    except ValueError:  # not written as an integer, or too long for one
        return float(text)


def parse_bool(text: str) -> bool | None:
    """Return the boolean that a text is in YAML; None: it is none."""
    return _WORDS.get(text.strip().lower())


def parse_list(text: str) -> list[str] | None:
    """Return the items of a list in brackets that has no other list in it; None: it is none."""
    text = text.strip()
    if not (text.startswith('[') and text.endswith(']')):
        return None
    items = [item.strip() for item in text[1:-1].split(',')]
    return items if items[-1] else items[:-1]  # YAML allows a comma after the last item


def _quoted(text: str) -> str:
    """Return a text as a string in double quotes; what ROS cannot send becomes U+0001."""
    result = []
    for character in text:
        code = ord(character)
        if code == 0 or 0xD800 <= code < 0xE000:
            code = 1
        if character in '"\\':
            result.append('\\' + character)
        elif character.isprintable():
            result.append(character)
        else:
            result.append(f'\\U{code:08x}')
    return '"' + ''.join(result) + '"'


def write(value: object) -> str:
    """Return a boolean, number, string, or a list of those in YAML, on one line."""
    if isinstance(value, (list, tuple)):
        return '[' + ', '.join(write(item) for item in value) + ']'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isfinite(value):
            text = repr(float(value))  # of a NumPy number too
            # Without a point, PyYAML and so `ros2 param` read 1e-05 as a string.
            return text if '.' in text else text.replace('e', '.0e')
        return '.nan' if math.isnan(value) else '.inf' if value > 0 else '-.inf'
    return _quoted(str(value))


def write_tree(values: Mapping[str, Any], indent: int = 0) -> str:
    """Return nested mappings of values as YAML, one value a line; inner ones are not empty."""
    lines = []
    for name, value in values.items():
        if isinstance(value, Mapping):
            lines.append(f'{" " * indent}{name}:\n{write_tree(value, indent + 2)}')
        else:
            lines.append(f'{" " * indent}{name}: {write(value)}\n')
    return ''.join(lines)
