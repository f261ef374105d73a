"""Selection of particles by indices and slices, as in Python: the pins of a scene."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from .parameter import invalid_value_error

_INDEX = re.compile(r'\s*[+-]?\d+\s*')
_SLICE = re.compile(r'\s*([+-]?\d+)?\s*:\s*([+-]?\d+)?\s*(?::\s*([+-]?\d+)?\s*)?')
_FORM = '"row,column" with indices or slices, such as "0,-1" or "0,:"'


def _select(part: str, count: int, what: str, pin: str) -> slice:
    if _INDEX.fullmatch(part):
        index = int(part)
        if not -count <= index < count:
            raise invalid_value_error(
                'pins',
                pin,
                f'a {what} of {-count} to {count - 1}',
                f'the sheet has {count} {what}s',
            )
        return slice(index % count, index % count + 1)
    match = _SLICE.fullmatch(part)
    if match is None or (match[3] and int(match[3]) == 0):
        raise invalid_value_error('pins', pin, _FORM, f'correct the {what}')
    selected = slice(*(None if group is None else int(group) for group in match.groups()))
    if not range(*selected.indices(count)):
        raise invalid_value_error(
            'pins', pin, 'a selection of at least one particle', 'widen the slice'
        )
    return selected


def pinned_particles(
    pins: Iterable[str], rows: int, columns: int
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """
    Return the pinned particles as an array of bool, shape (rows, columns).

    An empty string pins nothing: ROS parameter files cannot type an empty list.

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
        if len(parts) != 2:
            raise invalid_value_error('pins', pin, _FORM, 'give one row and one column')
        pinned[_select(parts[0], rows, 'row', pin), _select(parts[1], columns, 'column', pin)] = (
            True
        )
    return pinned
