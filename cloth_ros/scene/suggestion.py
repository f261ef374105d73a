"""What to write instead of a wrong value or name: the closest that is allowed."""

from __future__ import annotations

import difflib
import math
import numbers
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from .yaml_text import NUMBER, parse_bool, parse_list, parse_number

_LONGEST = 256  # characters of a text that is compared
_SIMILAR = 0.6  # least similarity of a name
_SEPARATOR = re.compile(r'[/:_ -]')


def _number_in(value: Any) -> float | None:
    """Return the number in a value: in a text such as ``60 Hz``, or as the only one in a list."""
    if isinstance(value, str):
        match = NUMBER.search(value[:_LONGEST].replace('_', ''))
        return parse_number(match[0]) if match else None
    if isinstance(value, (list, tuple)) and len(value) == 1:
        return None if isinstance(value[0], (list, tuple)) else _number_in(value[0])
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        try:
            return float(value)
        except (OverflowError, TypeError, ValueError):
            return None
    return None


def closest_number(value: object, default: float, low: float, high: float) -> float:
    """Return the allowed number closest to a value, in the type of the default."""
    number = _number_in(value)
    if number is None or math.isnan(number):
        number = default
    number = min(max(number, low), high)
    if math.isinf(number):  # and so is the bound
        number = min(max(default, low), high)
    return round(number) if isinstance(default, int) else float(number)


def closest_vector(
    value: Any, default: Sequence[float], low: float, high: float
) -> tuple[float, ...]:
    """Return allowed numbers close to a value that is not such a list; two are made from one."""
    items = (parse_list(value) or value) if isinstance(value, str) else value
    if isinstance(items, (list, tuple)):
        if len(items) == len(default):
            return tuple(
                closest_number(item, start, low, high)
                for item, start in zip(items, default, strict=True)
            )
        value = items
    if len(default) == 2 and _number_in(value) is not None:
        return (closest_number(value, default[0], low, high),) * 2
    return tuple(default)


def closest_choice(value: object, default: str, choices: Sequence[str]) -> str:
    """Return the choice most similar to a value, or else the default or the first."""
    text = value[:_LONGEST].strip('\'" ').lower() if isinstance(value, str) else ''
    similar = difflib.get_close_matches(text, choices, n=1)
    return (*similar, default if default in choices else choices[0])[0]


def closest_bool(value: object, default: bool) -> bool:
    """Return the boolean that a number or a text probably means."""
    if isinstance(value, (int, float)):
        return bool(value)
    meant = parse_bool(value.strip('\'" ')) if isinstance(value, str) else None
    return default if meant is None else meant


def closest_name(name: str, known: Iterable[str]) -> str | None:
    """Return the most similar of dotted names; None: none is similar."""
    name = _SEPARATOR.sub('.', name[:_LONGEST].lower())
    best, result = _SIMILAR, None
    matcher = difflib.SequenceMatcher(autojunk=False)
    matcher.set_seq2(name)  # of which the matcher keeps an index
    for candidate in known:
        # A name without its group, such as `rows`, is nearly as good.
        for text, share in ((candidate, 1.0), (candidate.rpartition('.')[2], 0.95)):
            matcher.set_seq1(_SEPARATOR.sub('.', text.lower()))
            likeness = share * matcher.ratio()
            if likeness > best:
                best, result = likeness, candidate
    return result


def member_names(name: str, members: Mapping[str, Iterable[str]], *, group: bool) -> Iterator[str]:
    """
    Yield the names in open groups that a misspelt name of a member may mean.

    Parameters
    ----------
    name
        ``colliders.table``, or ``collider.table.radios``.
    members
        Fields of the members, by open group.
    group
        True if it is the name of a member, and not of one of its parameters.

    """
    parts = re.split('[./:]', name[:_LONGEST])  # not at _, which names contain
    for open_group, fields in members.items():
        if group and len(parts) == 2:
            yield f'{open_group}.{parts[1]}'
        elif not group and len(parts) == 3:
            yield from (f'{open_group}.{parts[1]}.{field}' for field in fields)


def closest_strings(value: Any, default: Sequence[str]) -> tuple[str, ...]:
    """Return the strings that a text or a list in which some are missing probably means."""
    if isinstance(value, str):  # without brackets, or without quotes
        text = value[:_LONGEST].strip('[]\'" ')
        return (text,) if text and '"' not in text and "'" not in text else tuple(default)
    if not isinstance(value, (list, tuple)):
        return tuple(default)
    if len(value) == 2 and all(isinstance(item, int) for item in value):  # a pin without quotes
        return (f'{value[0]},{value[1]}',)
    return tuple(item for item in value if isinstance(item, str)) or tuple(default)
