"""
Declaration of parameters with unit, range and meaning, and their validation.

A `ParameterGroup` is a frozen dataclass with fields declared by `parameter`.  The declaration
alone gives a parameter's default, unit, range and text: validation, the ROS parameter
descriptors and the table in docs/parameters.md are derived from it.
"""

from __future__ import annotations

import array
import dataclasses
import math
import numbers
import reprlib
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

_METADATA = 'specification'
# As many pins as the edges of the largest sheet have particles.
MAX_LIST_LENGTH = 4096
_MAX_STRING_LENGTH = 256


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
        return f'{self.low:g} to {self.high:g} {self.unit}'.rstrip()


def parameter(
    default: Any,
    text: str,
    *,
    unit: str = '',
    low: float | None = None,
    high: float | None = None,
    choices: Sequence[str] = (),
    fixed: bool = False,
) -> Any:
    """
    Declare a parameter as a dataclass field.

    Parameters
    ----------
    default
        Default value; its type (bool, int, float, str, tuple of float or of str) is the type of
        the parameter, and the length of a tuple of floats is the length of the parameter.
    text, unit
        Meaning and SI unit, for people.
    low, high
        Inclusive range of a number, or of each number of a tuple.
    choices
        Allowed strings.
    fixed
        True if the parameter cannot change while a cloth is running.

    """
    known = ParameterSpec(text, unit, low, high, tuple(choices), fixed)
    return dataclasses.field(default=default, metadata={_METADATA: known})


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


def _number(name: str, value: object, known: ParameterSpec) -> float:
    try:
        # Not everything that float() accepts: it takes strings, bytes and arrays of one number.
        if isinstance(value, (bool, np.timedelta64)) or not isinstance(value, numbers.Real):
            raise TypeError
        number = float(value)
    except (TypeError, OverflowError):
        raise invalid_value_error(
            name, value, f'a number, {known.range_text}'.rstrip(', '), 'give a number'
        ) from None
    low = -math.inf if known.low is None else known.low
    high = math.inf if known.high is None else known.high
    if not math.isfinite(number):
        raise invalid_value_error(
            name, value, f'finite, {known.range_text}'.rstrip(', '), 'give a number'
        )
    if not low <= number <= high:
        nearest = f'the nearest allowed value is {min(max(number, low), high):g}'
        raise invalid_value_error(name, value, known.range_text, nearest)
    return number


def _integer(name: str, value: object, known: ParameterSpec) -> int:
    number = _number(name, value, known)
    if number != int(number):
        raise invalid_value_error(name, value, f'a whole number, {known.range_text}', 'round it')
    whole = int(value)  # type: ignore[call-overload]
    # Not int(number): a double cannot carry a large seed.
    if known.high is not None and whole > known.high:
        raise invalid_value_error(name, value, known.range_text, f'the largest is {known.high}')
    if known.low is not None and whole < known.low:  # and a fraction just below it is rounded up
        raise invalid_value_error(name, value, known.range_text, f'the least is {known.low}')
    return whole  # type: ignore[no-any-return]


def _items(name: str, value: Any, kind: str) -> list[Any]:
    is_array = hasattr(value, 'tolist')  # NumPy and array.array alike
    text = isinstance(value, (str, bytes, bytearray, memoryview))
    try:
        if text or not (is_array or isinstance(value, Sequence)):
            raise TypeError
        length = len(value)
    except (TypeError, OverflowError):  # of an array without dimensions, of a huge range
        raise invalid_value_error(name, value, f'a list of {kind}', 'put it in brackets') from None
    if length > MAX_LIST_LENGTH:
        raise invalid_value_error(
            f'the length of {name}', length, f'at most {MAX_LIST_LENGTH}', 'shorten it'
        )
    return value.tolist() if is_array else list(value)


def _string(name: str, value: object) -> str:
    if not isinstance(value, str):
        raise invalid_value_error(name, value, 'a string', 'put it in quotes')
    # ROS can send neither NUL nor a lone surrogate.
    if len(value) > _MAX_STRING_LENGTH or not value.isprintable():
        allowed = f'at most {_MAX_STRING_LENGTH} characters that can be printed'
        raise invalid_value_error(name, value, allowed, 'correct it')
    return value


def convert(name: str, value: object, default: object, known: ParameterSpec) -> Any:
    """
    Return `value` in the type of `default`, checked against the range.

    Raises
    ------
    ValueError
        Names the parameter, the value, what is allowed and the remedy.

    """
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise invalid_value_error(name, value, 'true or false', 'give one of the two')
        return value
    if isinstance(default, int):
        return _integer(name, value, known)
    if isinstance(default, float):
        return _number(name, value, known)
    if isinstance(default, str):
        if known.choices and not (isinstance(value, str) and value in known.choices):
            raise invalid_value_error(name, value, known.range_text, 'choose one')
        return _string(name, value)
    assert isinstance(default, tuple)
    if default and isinstance(default[0], float):
        items = _items(name, value, 'numbers')
        if len(items) != len(default):
            raise invalid_value_error(
                name, value, f'a list of {len(default)} numbers', 'give them all'
            )
        return tuple(_number(f'{name}[{i}]', item, known) for i, item in enumerate(items))
    strings = _items(name, value, 'strings')
    return tuple(_string(f'{name}[{i}]', item) for i, item in enumerate(strings))


def _is_group(value: object) -> bool:
    return isinstance(value, (Mapping, ParameterGroup))


def _merged(name: str, first: Any, second: Any) -> dict[Any, Any]:
    """Merge two values of one group: the later one overrides, but a whole group is the base."""
    for each in (first, second):
        if not _is_group(each):
            raise invalid_value_error(name, each, 'a group of parameters', 'nest it')
    if isinstance(second, ParameterGroup):
        first, second = second, first
    result = dict(vars(first) if isinstance(first, ParameterGroup) else first)
    for key, value in (vars(second) if isinstance(second, ParameterGroup) else second).items():
        if key in result and (_is_group(result[key]) or _is_group(value)):
            value = _merged(f'{name}.{format_value(key)}', result[key], value)
        result[key] = value
    return result


@dataclasses.dataclass(frozen=True)
class ParameterGroup:
    """A validated set of parameters; `prefix` is its place in the parameter tree."""

    prefix: ClassVar[str] = ''

    def __post_init__(self) -> None:
        """Convert and check every field; nested groups may be given as mappings."""
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            default = default_of(field)
            if isinstance(default, ParameterGroup):
                if isinstance(value, Mapping):
                    value = type(default).from_mapping(value)
                elif not isinstance(value, type(default)):
                    name = self.prefix + field.name
                    raise invalid_value_error(
                        name, value, f'a {type(default).__name__}', 'nest it'
                    )
            else:
                known = field.metadata[_METADATA]
                value = convert(self.prefix + field.name, value, default, known)
            object.__setattr__(self, field.name, value)
        self.check()

    def check(self) -> None:
        """Check that the fields agree; raises ValueError."""

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Any:
        """Build the group from a mapping, nested or with dotted names, or both."""
        if not isinstance(values, Mapping):
            raise invalid_value_error(
                'the scene', values, 'a mapping of names to values', 'give one'
            )
        known = {field.name: field for field in dataclasses.fields(cls)}
        arguments: dict[str, Any] = {}
        for name, value in values.items():
            if not isinstance(name, str):
                raise invalid_value_error(
                    f'a name in {cls.__name__}', name, 'a string', 'put it in quotes'
                )
            head, dot, rest = name.partition('.')
            if head not in known:
                raise unknown_parameter_error(cls.prefix + name, list(PARAMETERS))
            if dot:
                value = {rest: value}
            if head in arguments:
                value = _merged(cls.prefix + head, arguments[head], value)
            arguments[head] = value
        return cls(**arguments)

    def flat(self) -> dict[str, Any]:
        """Return all parameters below this group by their dotted names."""
        result: dict[str, Any] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, ParameterGroup):
                result.update(value.flat())
            else:
                result[self.prefix + field.name] = value
        return result


PARAMETERS: dict[str, ParameterSpec] = {}


def register(root: type[ParameterGroup]) -> None:
    """Fill `PARAMETERS` with every parameter of the tree below `root`."""
    for field in dataclasses.fields(root):
        default = default_of(field)
        if isinstance(default, ParameterGroup):
            register(type(default))
        else:
            PARAMETERS[root.prefix + field.name] = field.metadata[_METADATA]


def default_of(field: dataclasses.Field[Any]) -> Any:
    """Return the default of a dataclass field, made by its factory if it has one."""
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def unknown_parameter_error(name: str, known: list[str]) -> ValueError:
    """Return the error for an unknown parameter name, with the most similar known one."""
    import difflib

    near = difflib.get_close_matches(name[:_MAX_STRING_LENGTH], known, n=1)
    remedy = f'did you mean {near[0]!r}?' if near else 'see docs/parameters.md'
    return ValueError(f'{format_value(name)} is not a parameter of a scene; {remedy}')


def checked_vector(name: str, vector: Sequence[float], parameter: str) -> NDArray[np.float64]:
    """
    Return a vector of three finite numbers as an array, shape (3,).

    Parameters
    ----------
    name
        Of the vector, for the error.
    vector
        Three numbers.
    parameter
        Name of the scene parameter whose range holds for each of them.

    Raises
    ------
    ValueError
        The vector has not three numbers, or one is not finite or out of range.

    """
    limit = PARAMETERS[parameter]
    try:
        return np.array(convert(name, vector, (0.0, 0.0, 0.0), limit))
    except ValueError:
        allowed = f'three finite numbers, each {limit.range_text}'
        raise invalid_value_error(name, vector, allowed, 'correct it') from None


def checked_number(name: str, value: object, low: float, high: float, unit: str) -> float:
    """Return a finite number within a range as a float; raises ValueError otherwise."""
    return _number(name, value, ParameterSpec('', unit, low, high))
