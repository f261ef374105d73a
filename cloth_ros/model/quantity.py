"""
Parameters that know their unit, range and meaning.

A `Group` is a frozen dataclass whose fields are declared with `quantity`.  The declaration is the
only home of a parameter's default, unit, range and text: validation, the ROS parameter
descriptors and the table in the README are all derived from it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

_METADATA = 'quantity'


@dataclasses.dataclass(frozen=True)
class Quantity:
    """What is known of one parameter besides its value."""

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


def quantity(
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
    known = Quantity(text, unit, low, high, tuple(choices), fixed)
    return dataclasses.field(default=default, metadata={_METADATA: known})


def refuse(name: str, value: object, allowed: str, remedy: str) -> ValueError:
    """Return the error for a refused value, in the one form that all of them have."""
    return ValueError(f'{name} is {value!r}, but must be {allowed}; {remedy}')


def _number(name: str, value: object, known: Quantity) -> float:
    try:
        if isinstance(value, (bool, str)):
            raise TypeError
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise refuse(
            name, value, f'a number, {known.range_text}'.rstrip(', '), 'give a number'
        ) from None
    low = -math.inf if known.low is None else known.low
    high = math.inf if known.high is None else known.high
    if not math.isfinite(number):
        raise refuse(name, value, f'finite, {known.range_text}'.rstrip(', '), 'give a number')
    if not low <= number <= high:
        nearest = f'the nearest allowed value is {min(max(number, low), high):g}'
        raise refuse(name, value, known.range_text, nearest)
    return number


def _integer(name: str, value: object, known: Quantity) -> int:
    number = _number(name, value, known)
    if number != int(number):
        raise refuse(name, value, f'a whole number, {known.range_text}', 'round it')
    # Not int(number): a double cannot carry a large seed.
    return int(value)  # type: ignore[call-overload, no-any-return]


def _items(name: str, value: object, kind: str) -> list[Any]:
    tolist = getattr(value, 'tolist', None)  # NumPy and array.array alike
    value = value if tolist is None else tolist()
    if isinstance(value, (str, bytes)) or not isinstance(value, Sequence):
        raise refuse(name, value, f'a list of {kind}', 'put it in brackets')
    return list(value)


def convert(name: str, value: object, default: object, known: Quantity) -> Any:
    """
    Return `value` in the type of `default`, checked against the range.

    Raises
    ------
    ValueError
        Names the parameter, the value, what is allowed and the remedy.

    """
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise refuse(name, value, 'true or false', 'give one of the two')
        return value
    if isinstance(default, int):
        return _integer(name, value, known)
    if isinstance(default, float):
        return _number(name, value, known)
    if isinstance(default, str):
        if not isinstance(value, str) or (known.choices and value not in known.choices):
            raise refuse(name, value, known.range_text or 'a string', 'choose one')
        return value
    assert isinstance(default, tuple)
    if default and isinstance(default[0], float):
        numbers = _items(name, value, 'numbers')
        if len(numbers) != len(default):
            raise refuse(name, value, f'a list of {len(default)} numbers', 'give them all')
        return tuple(_number(f'{name}[{i}]', item, known) for i, item in enumerate(numbers))
    strings = _items(name, value, 'strings')
    if not all(isinstance(item, str) for item in strings):
        raise refuse(name, value, 'a list of strings', 'put each in quotes')
    return tuple(strings)


@dataclasses.dataclass(frozen=True)
class Group:
    """A validated set of parameters; `prefix` is its place in the parameter tree."""

    prefix: ClassVar[str] = ''

    def __post_init__(self) -> None:
        """Convert and check every field; nested groups may be given as mappings."""
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            default = default_of(field)
            if isinstance(default, Group):
                if isinstance(value, Mapping):
                    value = type(default).from_mapping(value)
                elif not isinstance(value, type(default)):
                    name = self.prefix + field.name
                    raise refuse(name, value, f'a {type(default).__name__}', 'nest it')
            else:
                known = field.metadata[_METADATA]
                value = convert(self.prefix + field.name, value, default, known)
            object.__setattr__(self, field.name, value)
        self.check()

    def check(self) -> None:
        """Check what no single field can tell; raises ValueError."""

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Any:
        """Build the group from a mapping, nested or with dotted names, or both."""
        known = {field.name: field for field in dataclasses.fields(cls)}
        arguments: dict[str, Any] = {}
        for name, value in values.items():
            head, dot, rest = str(name).partition('.')
            if head not in known:
                raise unknown_name(cls.prefix + str(name), list(PARAMETER_NAMES))
            if dot:
                value = {rest: value}
            if isinstance(value, Mapping) and isinstance(arguments.get(head), Mapping):
                value = {**arguments[head], **value}
            arguments[head] = value
        return cls(**arguments)

    def flat(self) -> dict[str, Any]:
        """Return all parameters below this group by their dotted names."""
        result: dict[str, Any] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, Group):
                result.update(value.flat())
            else:
                result[self.prefix + field.name] = value
        return result


PARAMETER_NAMES: dict[str, Quantity] = {}


def register(root: type[Group]) -> None:
    """Fill `PARAMETER_NAMES` with every parameter of the tree below `root`."""
    for field in dataclasses.fields(root):
        default = default_of(field)
        if isinstance(default, Group):
            register(type(default))
        else:
            PARAMETER_NAMES[root.prefix + field.name] = field.metadata[_METADATA]


def default_of(field: dataclasses.Field[Any]) -> Any:
    """Return the default of a dataclass field, made by its factory if it has one."""
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def unknown_name(name: str, known: list[str]) -> ValueError:
    """Return the error for a parameter name that does not exist, with the likeliest one meant."""
    import difflib

    near = difflib.get_close_matches(name, known, n=1)
    remedy = f'did you mean {near[0]!r}?' if near else 'see the table of parameters in README.md'
    return ValueError(f'{name!r} is not a parameter of a scene; {remedy}')


def checked_vector(name: str, vector: Sequence[float], parameter: str) -> NDArray[np.float64]:
    """
    Return a vector of three finite numbers as an array, shape (3,).

    Parameters
    ----------
    name
        What the vector is, for the error.
    vector
        Three numbers.
    parameter
        Name of the scene parameter whose range holds for each of them.

    Raises
    ------
    ValueError
        The vector has not three numbers, or one is not finite or out of range.

    """
    limit = PARAMETER_NAMES[parameter]
    allowed = f'three finite numbers, each {limit.range_text}'
    try:
        array = np.array(vector, float)
    except (TypeError, ValueError, OverflowError):
        raise refuse(name, vector, allowed, 'correct it') from None
    if array.shape != (3,):
        raise refuse(name, vector, allowed, 'give x, y and z')
    # In Python, three times as fast for three numbers; False for NaN.
    if not all(limit.low <= number <= limit.high for number in array.tolist()):
        raise refuse(name, array.tolist(), allowed, 'correct it')
    return array
