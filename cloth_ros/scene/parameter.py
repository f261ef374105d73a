"""
Declaration of parameters with unit, range and meaning, and their validation.

A `ParameterGroup` is a frozen dataclass with fields declared by `parameter`.  The declaration
alone gives a parameter's default, unit, range and text: validation, the ROS parameter
descriptors and the table in docs/parameters.md are derived from it.

Most names are fixed.  An open group, such as the colliders, has a group of parameters for each of
its members, whose names the user chooses: ``collider.table.friction``.  `declaration` knows both.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

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
    'MEMBERS',
    'PARAMETERS',
    'Declaration',
    'ParameterGroup',
    'ParameterSpec',
    'checked_number',
    'checked_vector',
    'convert',
    'declaration',
    'default_of',
    'format_error',
    'format_value',
    'group_error',
    'grouped',
    'invalid_value_error',
    'is_group',
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


def group_error(name: str, value: object) -> ValueError:
    """Return the error for a value in the place of a group of parameters."""
    example = next((known for known in PARAMETERS if known.startswith(f'{name}.')), None)
    remedy = f'write {example}: {write(DEFAULTS[example])}' if example else 'give it once'
    if example is None and is_group(name):
        field, (known, default) = next(iter(MEMBERS[name.partition('.')[0]].items()))
        remedy = f'write {name}.{field}: {write((*known.choices, default)[0])}'
    return invalid_value_error(name, value, 'a group of parameters', remedy)


def _merged(name: str, first: Any, second: Any) -> dict[Any, Any]:
    """Merge two values of one group: the later one overrides, but a whole group is the base."""
    for each in (first, second):
        if not _is_group(each):
            raise group_error(name, each)
    if isinstance(second, ParameterGroup):
        first, second = second, first
    result = dict(first.children() if isinstance(first, ParameterGroup) else first)
    others = second.children() if isinstance(second, ParameterGroup) else second
    for key, value in others.items():
        inner = f'{name}.{key if isinstance(key, str) else format_value(key)}'
        is_group = declaration(inner) is None and (_is_group(result.get(key)) or _is_group(value))
        if key in result and is_group:
            value = _merged(inner, result[key], value)
        result[key] = value
    return result


def grouped(
    values: Mapping[str, Any], prefix: str, known: Callable[[str], bool]
) -> dict[str, Any]:
    """
    Return the values of a group by the first part of their dotted names.

    Parameters
    ----------
    values
        Nested or with dotted names, or both.
    prefix
        Of the group, for errors.
    known
        Whether a first part belongs to the group.

    Raises
    ------
    ValueError
        A name is not known or not a string, or one value of a group given twice is no group.

    """
    if not isinstance(values, Mapping):
        raise invalid_value_error(
            'the scene', values, 'a mapping of names to values', "write {'rate': 60.0}"
        )
    result: dict[str, Any] = {}
    for name, value in values.items():
        if not isinstance(name, str):
            where = prefix[:-1] or 'a scene'
            raise invalid_value_error(f'a name in {where}', name, 'a string', 'put it in quotes')
        head, dot, rest = name.partition('.')
        if not known(head):
            raise unknown_parameter_error(prefix + name, group=_is_group(value))
        if dot:
            value = {rest: value}
        if head in result:
            value = _merged(prefix + head, result[head], value)
        result[head] = value
    return result


@dataclasses.dataclass(frozen=True)
class ParameterGroup:
    """
    A validated set of parameters.

    Attributes
    ----------
    prefix
        Place in the parameter tree.
    member
        Of an open group, the group of each member; None: the group is not open.

    """

    prefix: ClassVar[str] = ''
    member: ClassVar[type[ParameterGroup] | None] = None

    def __post_init__(self) -> None:
        """Convert and check every field; nested groups may be given as mappings."""
        for field in self.fields():
            value, name = getattr(self, field.name), self.full_name(field.name)
            default = default_of(field)
            if isinstance(default, ParameterGroup):
                if isinstance(value, Mapping):
                    value = type(default).from_mapping(value)
                elif not isinstance(value, type(default)):
                    raise group_error(name, value)
            else:
                value = self.converted(name, value, default, field.metadata[_METADATA])
            object.__setattr__(self, field.name, value)
        self.check()

    @staticmethod
    def converted(name: str, value: object, default: object, known: ParameterSpec) -> Any:
        """Return the value of a parameter in its type, checked against its range."""
        return convert(name, value, default, known)

    def check(self) -> None:
        """Check that the fields agree; raises ValueError."""

    @classmethod
    def fields(cls) -> tuple[dataclasses.Field[Any], ...]:
        """Return the dataclass fields that are parameters or groups."""
        if cls not in _fields:
            _fields[cls] = tuple(
                field
                for field in dataclasses.fields(cls)
                if _METADATA in field.metadata or isinstance(default_of(field), ParameterGroup)
            )
        return _fields[cls]

    def full_name(self, field: str) -> str:
        """Return the dotted name of a field."""
        return self.prefix + field

    def children(self) -> dict[str, Any]:
        """Return the parameters and groups in this group, by the next part of their names."""
        return {field.name: getattr(self, field.name) for field in self.fields()}

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Any:
        """Build the group from a mapping, nested or with dotted names, or both."""
        names = {field.name for field in cls.fields()}
        return cls(**grouped(values, cls.prefix, names.__contains__))

    def changed(self) -> dict[str, Any]:
        """Return the parameters that differ from their defaults, nested like the groups."""
        result: dict[str, Any] = {}
        for field in self.fields():
            value, default = getattr(self, field.name), default_of(field)
            if isinstance(value, ParameterGroup):
                if inner := value.changed():
                    result[field.name] = inner
            elif value != default:
                # ROS cannot tell the type of an empty list.
                result[field.name] = [''] if value == () else value
        return result

    def flat(self) -> dict[str, Any]:
        """Return all parameters below this group by their dotted names."""
        result: dict[str, Any] = {}
        for name, value in self.children().items():
            if isinstance(value, ParameterGroup):
                result.update(value.flat())
            else:
                result[self.full_name(name)] = value
        return result


_fields: dict[type[ParameterGroup], tuple[dataclasses.Field[Any], ...]] = {}


class Declaration(NamedTuple):
    """What is declared about a parameter."""

    spec: ParameterSpec
    default: Any


# Parameters with fixed names: their specification and default.
PARAMETERS: dict[str, ParameterSpec] = {}
DEFAULTS: dict[str, Any] = {}
# Names of the fields of each group, and the parameters that each member of an open group has.
GROUPS: dict[str, list[str]] = {}
MEMBERS: dict[str, dict[str, Declaration]] = {}


def register(root: type[ParameterGroup]) -> None:
    """Fill `PARAMETERS`, `DEFAULTS`, `GROUPS` and `MEMBERS` with the tree below `root`."""
    group = root.prefix[:-1]
    if group:
        GROUPS[group] = [field.name for field in root.fields()]
    if root.member is not None:
        MEMBERS[group] = {
            field.name: Declaration(field.metadata[_METADATA], default_of(field))
            for field in root.member.fields()
        }
        GROUPS[group] += [f'NAME.{name}' for name in MEMBERS[group]]
    for field in root.fields():
        default = default_of(field)
        if isinstance(default, ParameterGroup):
            register(type(default))
        else:
            PARAMETERS[root.prefix + field.name] = field.metadata[_METADATA]
            DEFAULTS[root.prefix + field.name] = default


def _of_member(name: str) -> tuple[str, str, str] | None:
    """Return open group, member and field in a dotted name; None: it is not of a member."""
    group, _, rest = name.partition('.')
    member, _, field = rest.partition('.')
    if group not in MEMBERS or not member or member in GROUPS[group]:
        return None
    return group, member, field


def declaration(name: str) -> Declaration | None:
    """Return the declaration of a parameter, such as ``rate`` or ``collider.table.type``."""
    if name in PARAMETERS:
        return Declaration(PARAMETERS[name], DEFAULTS[name])
    place = _of_member(name)
    return None if place is None else MEMBERS[place[0]].get(place[2])


def is_group(name: str) -> bool:
    """Return True for the name of a group, such as ``wind`` or ``collider.table``."""
    place = _of_member(name)
    return name in GROUPS or (place is not None and not place[2])


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
    members = suggestion.member_names(name, MEMBERS, group=group)
    known = GROUPS if group else (*PARAMETERS, *GROUPS, *others)
    near = suggestion.closest_name(name, (*known, *members))
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
