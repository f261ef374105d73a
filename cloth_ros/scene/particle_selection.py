"""Selection of particles by indices and slices, as in Python: the pins of a scene."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from .conversion import invalid_value_error
from .yaml_text import write

_INDEX = re.compile(r'\s*[+-]?\d+\s*')
_SLICE = re.compile(r'\s*([+-]?\d+)?\s*:\s*([+-]?\d+)?\s*(?::\s*([+-]?\d+)?\s*)?')
_NUMBER = re.compile(r'[+-]?\d+')
_FORM = '"row,column" with indices or slices, such as "0,-1" or "0,:"'


class _NotSelectedError(Exception):
    """A part of a pin selects no row or column; its text says what a pin must be."""


def _select(part: str, count: int, what: str) -> slice:
    if _INDEX.fullmatch(part):
        index = int(part)
        if not -count <= index < count:
            raise _NotSelectedError(f'a {what} of {-count} to {count - 1}')
        return slice(index % count, index % count + 1)
    match = _SLICE.fullmatch(part)
    if match is None or (match[3] and int(match[3]) == 0):
        raise _NotSelectedError(_FORM)
    selected = slice(*(None if group is None else int(group) for group in match.groups()))
    if not range(*selected.indices(count)):
        raise _NotSelectedError('a selection of at least one particle')
    return selected


def _closest_part(part: str, count: int) -> str:
    """Return a part of a pin if it is valid, or the index closest to the first number in it."""
    try:
        _select(part, count, '')
    except _NotSelectedError:
        number = _NUMBER.search(part)
        return str(min(max(int(number[0]) if number else 0, -count), count - 1))
    return part.strip()


def _closest_pin(pin: str, rows: int, columns: int) -> str:
    """Return a valid pin that a wrong one probably means."""
    parts = pin.split(',')
    if len(parts) != 2:
        parts = [*_NUMBER.findall(pin), ':', ':'][:2]
    return f'{_closest_part(parts[0], rows)},{_closest_part(parts[1], columns)}'


def pinned_particles(
    pins: Iterable[str], rows: int, columns: int
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """
    Return the pinned particles as an array of bool, shape (rows, columns).

    An empty string pins nothing, as does an empty list.

    Raises
    ------
    ValueError
        A pin cannot be read, or lies outside the sheet.

    """
    pinned = np.zeros((rows, columns), bool)
    for pin in pins:
        if not pin.strip():
            continue
        parts = pin.split(',')
        try:
            if len(parts) != 2:
                raise _NotSelectedError(_FORM)
            pinned[_select(parts[0], rows, 'row'), _select(parts[1], columns, 'column')] = True
        except _NotSelectedError as error:
            remedy = f'write {write(_closest_pin(pin, rows, columns))}'
            raise invalid_value_error('pins', pin, str(error), remedy) from None
    return pinned
