"""
Declaration of parameters with unit, range and meaning, and their validation.

A `ParameterGroup` is a frozen dataclass with fields declared by `parameter`.  The declaration
alone gives a parameter's default, unit, range and text: validation, the ROS parameter
descriptors and the table in docs/parameters.md are derived from it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from . import conversion, suggestion
from .conversion import (
    MAX_LIST_LENGTH,
    ParameterSpec,
    checked_number,
    convert,
    format_error,
    format_value,
    invalid_value_error,
    one_line,
)
from .yaml_text import write

__all__ = [
    'DEFAULTS',
    'GROUPS',
    'MAX_LIST_LENGTH',
    'PARAMETERS',
    'ParameterGroup',
    'ParameterSpec',
    'checked_number',
    'checked_vector',
    'convert',
    'default_of',
    'format_error',
    'format_value',
    'invalid_value_error',
    'one_line',
    'parameter',
    'register',
    'unknown_parameter_error',
]

_METADATA = 'specification'


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


def _is_group(value: object) -> bool:
    return isinstance(value, (Mapping, ParameterGroup))


def _group_error(name: str, value: object) -> ValueError:
    example = next((known for known in PARAMETERS if known.startswith(f'{name}.')), None)
    remedy = f'write {example}: {write(DEFAULTS[example])}' if example else 'give it once'
    return invalid_value_error(name, value, 'a group of parameters', remedy)


def _merged(name: str, first: Any, second: Any) -> dict[Any, Any]:
    """Merge two values of one group: the later one overrides, but a whole group is the base."""
    for each in (first, second):
        if not _is_group(each):
            raise _group_error(name, each)
    if isinstance(second, ParameterGroup):
        first, second = second, first
    result = dict(vars(first) if isinstance(first, ParameterGroup) else first)
    for key, value in (vars(second) if isinstance(second, ParameterGroup) else second).items():
        inner = f'{name}.{key if isinstance(key, str) else format_value(key)}'
        is_group = inner not in PARAMETERS and (_is_group(result.get(key)) or _is_group(value))
        if key in result and is_group:
            value = _merged(inner, result[key], value)
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
                    raise _group_error(self.prefix + field.name, value)
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
                'the scene', values, 'a mapping of names to values', "write {'rate': 60.0}"
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
                raise unknown_parameter_error(cls.prefix + name, group=_is_group(value))
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
# Defaults of the parameters, and the names of the fields of each group, by dotted names.
DEFAULTS: dict[str, Any] = {}
GROUPS: dict[str, list[str]] = {}


def register(root: type[ParameterGroup]) -> None:
    """Fill `PARAMETERS`, `DEFAULTS` and `GROUPS` with the tree below `root`."""
    if root.prefix:
        GROUPS[root.prefix[:-1]] = [field.name for field in dataclasses.fields(root)]
    for field in dataclasses.fields(root):
        default = default_of(field)
        if isinstance(default, ParameterGroup):
            register(type(default))
        else:
            PARAMETERS[root.prefix + field.name] = field.metadata[_METADATA]
            DEFAULTS[root.prefix + field.name] = default


def default_of(field: dataclasses.Field[Any]) -> Any:
    """Return the default of a dataclass field, made by its factory if it has one."""
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def unknown_parameter_error(
    name: str, *, group: bool = False, others: Iterable[str] = ()
) -> ValueError:
    """
    Return the error for an unknown name, with the most similar known one.

    Parameters
    ----------
    name
        The unknown name.
    group
        True if it is that of a group, and not of one parameter.
    others
        Names that are known besides those of scenes.

    """
    near = suggestion.closest_name(name, GROUPS if group else (*PARAMETERS, *GROUPS, *others))
    remedy = f'did you mean {near!r}?' if near else 'see docs/parameters.md'
    if near in GROUPS and not group:
        remedy = f'did you mean {near!r}, with {", ".join(GROUPS[near])}?'
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
        return np.array(conversion.vector(name, vector, (0.0, 0.0, 0.0), limit, text=False))
    except ValueError:
        allowed = f'three finite numbers, each {limit.range_text}'
        closest = suggestion.closest_vector(vector, DEFAULTS[parameter], *limit.bounds)
        raise invalid_value_error(name, vector, allowed, f'write {write(closest)}') from None
