"""
Conversion of values to the types of parameters, with errors that say what to write instead.

Every `ValueError` names the value, what is allowed, and after a semicolon the remedy: ``write …``,
with a value in YAML that is allowed, wherever there is one.
"""

from __future__ import annotations

import array
import dataclasses
import math
import numbers
import reprlib
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import suggestion
from .yaml_text import parse_bool, parse_list, parse_number, write

# As many pins as the edges of the largest sheet have particles.
MAX_LIST_LENGTH = 4096
_MAX_STRING_LENGTH = 256
_SUGGESTED_LENGTH = 80


@dataclasses.dataclass(frozen=True)
class ParameterSpec:
    """Unit, range and meaning of one parameter."""

    text: str
    unit: str = ''
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    fixed: bool = False

    @property
    def range_text(self) -> str:
        """Return the allowed values in words, such as ``0 to 1e+08 N/m``."""
        if self.choices:
            return 'one of ' + ', '.join(repr(choice) for choice in self.choices)
        if self.low is None or self.high is None:
            return ''
        return f'{_exact(self.low)} to {_exact(self.high)} {self.unit}'.rstrip()

    @property
    def bounds(self) -> tuple[float, float]:
        """Return the least and the greatest number; without a range, infinite ones."""
        low = -math.inf if self.low is None else self.low
        return low, math.inf if self.high is None else self.high


def _exact(number: float) -> str:
    """Return a number in a short form that is still the same number."""
    short = f'{number:g}'
    return short if float(short) == number else str(number)


_short = reprlib.Repr()
_short.maxstring = _short.maxother = 100


def one_line(text: str) -> str:
    """Return a text on one line, of characters that can be printed."""
    return ''.join(c if c.isprintable() else '?' for c in ' '.join(text.split()))


def format_error(error: BaseException) -> str:
    """Return the type and the text of an error on one line."""
    return one_line(f'{type(error).__name__}: {error}')


def format_value(value: object) -> str:
    """Return a value for an error message: on one line, and short."""
    if isinstance(value, array.array):  # as rclpy gives lists of numbers
        value = value[: _short.maxlist + 1].tolist()
    try:
        text = _short.repr(value)
    except ValueError:  # an integer of more digits than Python writes out
        text = f'a {type(value).__name__} too long to show'
    return one_line(text)


def invalid_value_error(name: str, value: object, allowed: str, remedy: str) -> ValueError:
    """Return the error for an invalid value, in the form that all of them share."""
    return ValueError(f'{name} is {format_value(value)}, but must be {allowed}; {remedy}')


def _number(
    name: str, value: object, known: ParameterSpec, default: float = 0.0, *, text: bool = True
) -> float:
    low, high = known.bounds
    meant = parse_number(value) if text and isinstance(value, str) else value
    try:
        # Not everything that float() accepts: it takes bytes and arrays of one number.
        if isinstance(meant, (bool, np.timedelta64)) or not isinstance(meant, numbers.Real):
            raise TypeError
        number = float(meant)
        if abs(number) < sys.float_info.min:  # rcl takes subnormal numbers for strings
            number = 0.0 * number
    except (TypeError, OverflowError):
        allowed = 'a number'
    else:
        if low <= number <= high and math.isfinite(number):
            return number
        allowed = '' if math.isfinite(number) else 'finite'
    closest = write(suggestion.closest_number(value, default, low, high))
    remedy = f'write {closest}' if allowed else f'the nearest allowed value is {closest}'
    allowed = ', '.join(filter(None, (allowed, known.range_text)))
    raise invalid_value_error(name, value, allowed, remedy)


def _integer(name: str, value: object, known: ParameterSpec, default: int) -> int:
    number = _number(name, value, known, default)
    # A double cannot carry a large seed, and rounds up a fraction just below the least.
    meant: Any = parse_number(value) if isinstance(value, str) else value
    low, high = known.bounds
    if number == int(number) and low <= int(meant) <= high:
        return int(meant)
    closest = suggestion.closest_number(value, default, low, high)
    allowed = f'a whole number, {known.range_text}'
    raise invalid_value_error(name, value, allowed, f'write {closest}')


def _items(value: Any) -> list[Any] | None:
    """Return the items of a list, tuple or array, of a long one some; None: it is none."""
    is_array = hasattr(value, 'tolist')  # NumPy and array.array alike
    if isinstance(value, (str, bytes, bytearray, memoryview)):
        return None
    try:
        if not (is_array or isinstance(value, Sequence)) or len(value) < 0:
            return None
    except (TypeError, OverflowError):  # of an array without dimensions, of a huge range
        return None
    some = value[: MAX_LIST_LENGTH + 1]
    return some.tolist() if is_array else list(some)


def vector(
    name: str,
    value: object,
    default: tuple[float, ...],
    known: ParameterSpec,
    *,
    text: bool = True,
) -> tuple[float, ...]:
    """Return as many numbers as `default` has, perhaps from text; raises ValueError."""
    items = _items(parse_list(value) if text and isinstance(value, str) else value)
    if items is None or len(items) != len(default):
        kind = ', each '.join(filter(None, (f'{len(default)} numbers', known.range_text)))
        closest = suggestion.closest_vector(value, default, *known.bounds)
        raise invalid_value_error(name, value, f'a list of {kind}', f'write {write(closest)}')
    return tuple(
        _number(f'{name}[{i}]', item, known, start, text=text)
        for i, (item, start) in enumerate(zip(items, default, strict=True))
    )


def _string(name: str, value: object, example: str) -> str:
    if not isinstance(value, str):
        text = format_value(value) if isinstance(value, numbers.Number) else example
        raise invalid_value_error(name, value, 'a string', f'write {write(text)}')
    # ROS can send neither NUL nor a lone surrogate.
    if len(value) > _MAX_STRING_LENGTH or not value.isprintable():
        allowed = f'at most {_MAX_STRING_LENGTH} characters that can be printed'
        printable = ''.join(filter(str.isprintable, value[:_SUGGESTED_LENGTH]))
        raise invalid_value_error(name, value, allowed, f'write {write(printable)}')
    return value


def _strings(name: str, value: Any, default: tuple[str, ...]) -> tuple[str, ...]:
    items = _items(value)
    if isinstance(value, str) and parse_list(value) == []:
        items = []
    if items is None or not all(isinstance(item, str) for item in items):
        closest = suggestion.closest_strings(value, default)
        raise invalid_value_error(name, value, 'a list of strings', f'write {write(closest)}')
    if len(items) > MAX_LIST_LENGTH:
        raise invalid_value_error(
            f'the length of {name}',
            len(value),
            f'at most {MAX_LIST_LENGTH}',
            'write slices, such as ["0,:"]',
        )
    return tuple(_string(f'{name}[{i}]', item, '') for i, item in enumerate(items))


def convert(name: str, value: object, default: object, known: ParameterSpec) -> Any:
    """
    Return `value` in the type of `default`, checked against the range.

    Numbers, booleans and lists of numbers may be given as text.  The default is allowed although
    it may not be among the choices: an empty string for what is not given.

    Raises
    ------
    ValueError
        Names the parameter, the value, what is allowed and the remedy.

    """
    if isinstance(default, bool):
        meant = parse_bool(value) if isinstance(value, str) else value
        if not isinstance(meant, bool):
            closest = suggestion.closest_bool(value, default)
            raise invalid_value_error(name, value, 'true or false', f'write {write(closest)}')
        return meant
    if isinstance(default, int):
        return _integer(name, value, known, default)
    if isinstance(default, float):
        return _number(name, value, known, default)
    if isinstance(default, str):
        if known.choices and not (isinstance(value, str) and value in (*known.choices, default)):
            choice = suggestion.closest_choice(value, default, known.choices)
            raise invalid_value_error(name, value, known.range_text, f'write {write(choice)}')
        return _string(name, value, default)
    assert isinstance(default, tuple)
    if default and isinstance(default[0], float):
        return vector(name, value, default, known)
    return _strings(name, value, default)


def unit_vector(
    name: str, vector: tuple[float, ...], what: str, example: tuple[float, ...]
) -> tuple[float, ...]:
    """
    Return a vector or quaternion of length one; ValueError if its length is zero.

    Parameters
    ----------
    name
        Of the parameter, for the error.
    vector
        Finite numbers.
    what
        'vector' or 'quaternion'.
    example
        What the error advises.

    """
    length = math.hypot(*vector)
    if length < 1e-9:
        raise invalid_value_error(
            name, list(vector), f'a {what} other than zero', f'write {write(example)}'
        )
    if abs(length - 1) < 1e-12:  # to the bit what it was, however often it is checked
        length = 1.0
    # Subnormal components, which rcl reads as strings, are zero.
    unit = [component / length for component in vector]
    return tuple(each if abs(each) >= sys.float_info.min else 0.0 for each in unit)


def checked_number(name: str, value: object, low: float, high: float, unit: str) -> float:
    """Return a finite number within a range as a float; raises ValueError otherwise."""
    return _number(name, value, ParameterSpec('', unit, low, high), text=False)
