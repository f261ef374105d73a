"""
Open groups: parameters of things whose names the user chooses, such as colliders and grippers.

``GROUP.names`` lists those of a scene, and ``GROUP.NAME.position`` and so on are the parameters of
each.  Parameters may be given for a name that is not listed, so that a member can be prepared one
parameter after the other before it is added; they have no effect until then.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from . import parameter_file
from .conversion import unit_vector
from .parameter import (
    ParameterGroup,
    ParameterSpec,
    convert,
    format_value,
    group_error,
    grouped,
    invalid_value_error,
    parameter,
)
from .quaternion import IDENTITY, Quaternion, Vector
from .yaml_text import write

MAX_MEMBERS = 64
# Names whose topics, markers or parameters there are already.
RESERVED_NAMES = (
    *('sphere', 'sphere_pose', 'wind', 'particles', 'markers', 'diagnostics', 'names'),
    *('clock', 'tf', 'tf_static', 'rosout', 'parameter_events', parameter_file.NODE_NAME),
    *('sheet', 'pins', 'springs'),
)
_NAME = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
_LONGEST_NAME = 64
_MOST_ADVISED = 3  # names in an error about too many of them


@dataclass(frozen=True)
class NamedMember(ParameterGroup):
    """
    Parameters of a member: a body with a pose, or one that follows a frame.

    Attributes
    ----------
    name
        Unique in the scene, a token of ROS names.
    position, orientation
        In the frame of the scene, or in `frame_id`: m, unit quaternion x y z w.
    frame_id
        Frame that the body follows; empty: that of the scene.
    group, written
        Prefix of the group, and the parameter that files always have, if only to list the body.

    """

    group: ClassVar[str]
    written: ClassVar[str]
    name: str = ''
    position: Vector = parameter(
        (0.0, 0.0, 0.0),
        'origin until a command comes, or in frame_id',
        unit='m',
        low=-1e6,
        high=1e6,
    )
    orientation: Quaternion = parameter(
        (0.0, 0.0, 0.0, 1.0),
        'quaternion x y z w until a command comes, or in frame_id',
        low=-1e6,
        high=1e6,
    )
    frame_id: str = parameter('', 'tf frame that it follows; empty: it does not')

    @classmethod
    def fields(cls) -> tuple[dataclasses.Field[Any], ...]:
        """Return the parameters: first those that only members of this group have."""
        shared = {field.name for field in dataclasses.fields(NamedMember)}
        return tuple(sorted(super().fields(), key=lambda field: field.name in shared))

    def full_name(self, field: str) -> str:
        """Return the dotted name of a field."""
        return f'{self.group}{self.name}.{field}'

    def check(self) -> None:
        """Normalise the quaternion."""
        name = self.full_name('orientation')
        unit = unit_vector(name, self.orientation, 'quaternion', IDENTITY)
        object.__setattr__(self, 'orientation', unit)

    def check_complete(self) -> None:
        """Raise ValueError if something that a member of a scene needs is not given."""

    @property
    def kind(self) -> str:
        """What it is, in one word."""
        return self.group[:-1]

    @property
    def pose(self) -> tuple[float, float, float, float, float, float, float]:
        """Position and orientation: where it is placed until it is moved."""
        return (*self.position, *self.orientation)


M = TypeVar('M', bound=NamedMember)


@dataclass(frozen=True)
class NamedGroup(ParameterGroup, Generic[M]):
    """
    The members of a scene, and parameters of others that are not added yet.

    Attributes
    ----------
    names
        Of the members of the scene.
    members
        Parameters, in the order of `names`, and after these those of others by their names.

    """

    member: ClassVar[type[NamedMember]]
    names: tuple[str, ...] = parameter((), 'names')
    members: tuple[M, ...] = ()

    @staticmethod
    def converted(name: str, value: object, default: object, known: ParameterSpec) -> Any:
        """Return the names, of which too many are refused before each is looked at."""
        if isinstance(value, (list, tuple)) and len(value) > MAX_MEMBERS:
            texts = [each for each in value[:MAX_MEMBERS] if isinstance(each, str)]
            some = list(dict.fromkeys(map(_valid_name, texts)))[:_MOST_ADVISED]
            raise invalid_value_error(
                f'the length of {name}',
                len(value),
                f'at most {MAX_MEMBERS}',
                f'write {write(some)}, or up to {MAX_MEMBERS} names',
            )
        return convert(name, value, default, known)

    def check(self) -> None:
        """Check names and members; leave out empty names, and sort the members."""
        kind = self.prefix[:-1]
        for place, name in enumerate(self.names):
            if name.strip():
                check_name(f'{self.prefix}names[{place}]', name, self.names[:place])
        names = tuple(name for name in self.names if name.strip())
        object.__setattr__(self, 'names', names)
        given: dict[str, Any] = {each.name: each for each in self.members}
        unnamed = sorted(set(given) - set(names))
        for name in unnamed:
            check_name(f'the name of a {kind}', name, ())
        if len(names) + len(unnamed) > MAX_MEMBERS:
            raise invalid_value_error(
                f'the number of {kind}s',
                len(names) + len(unnamed),
                f'at most {MAX_MEMBERS}, those with parameters alone included',
                f'write {self.prefix}names: {write(names[:_MOST_ADVISED])}, which removes the '
                'parameters of others',
            )
        members = [given.get(name, self.member(name=name)) for name in names]
        object.__setattr__(self, 'members', (*members, *(given[name] for name in unnamed)))
        for each in members:
            if each.name not in given and (near := _closest(each.name, unnamed)):
                right = [near if name == each.name else name for name in names]
                raise ValueError(
                    f'{each.full_name(each.written)} is not given, but that of {near!r} is; write '
                    f'{self.prefix}names: {write(right)}'
                )
            each.check_complete()

    @property
    def named(self) -> tuple[M, ...]:
        """The members of the scene, in the order of `names`."""
        return self.members[: len(self.names)]

    @property
    def unnamed(self) -> tuple[M, ...]:
        """Parameters of what is not in `names`."""
        return self.members[len(self.names) :]

    def children(self) -> dict[str, Any]:
        """Return the names, and the parameters of each member by its name."""
        return {'names': self.names, **{each.name: each for each in self.members}}

    def changed(self) -> dict[str, Any]:
        """Return the names, and of each member `written` and what differs from the defaults."""
        names = super().changed()
        return names | {
            each.name: {each.written: getattr(each, each.written), **each.changed()}
            for each in self.members
        }

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Any:
        """Build the group from a mapping, nested or with dotted names, or both."""
        children = grouped(values, cls.prefix, lambda _: True)
        names = children.pop('names', ())
        members = []
        for name, value in children.items():
            if isinstance(value, cls.member) and value.name == name:
                members.append(value)
                continue
            if isinstance(value, cls.member):
                value = value.children()
            elif not isinstance(value, Mapping):
                raise group_error(cls.prefix + name, value)
            prefix, fields = f'{cls.prefix}{name}.', {each.name for each in cls.member.fields()}
            known = grouped(value, prefix, fields.__contains__)
            members.append(cls.member(name=name, **known))
        made: Any = cls
        return made(names=names, members=tuple(members))

    def without(self, names: Collection[str]) -> Any:
        """Return the group without the parameters of members, by their dotted names."""
        dropped = {name.removeprefix(self.prefix) for name in names}
        return self._keeping(lambda each: each.name not in dropped)

    def without_unnamed(self, given: Collection[str]) -> Any:
        """Return the group without unnamed members, but for the parameters of these names."""
        kept = {name.split('.')[1] for name in given if name.startswith(self.prefix)}
        named = set(self.names)
        return self._keeping(lambda each: each.name in named | kept)

    def _keeping(self, keep: Callable[[M], bool]) -> Any:
        members = tuple(each for each in self.members if keep(each))
        if len(members) == len(self.members):
            return self
        # Not checked: `names` may be incomplete until the parameters of a change are merged.
        result = object.__new__(type(self))
        object.__setattr__(result, 'names', self.names)
        object.__setattr__(result, 'members', members)
        return result


def check_distinct(first: NamedGroup[Any], second: NamedGroup[Any]) -> None:
    """Raise ValueError if a name of one group is also one of the other: they share topics."""
    for place, name in enumerate(second.names):
        if name in first.names:
            others = (*first.names, *second.names)
            raise invalid_value_error(
                f'{second.prefix}names[{place}]',
                name,
                f'a name that is not in {first.prefix}names too',
                f'write {write(_valid_name(name, others))}',
            )


def _closest(name: str, others: Collection[str]) -> str | None:
    return next(iter(difflib.get_close_matches(name, others, n=1)), None)


def _valid_name(name: str, others: Collection[str] = ()) -> str:
    """Return a valid name that is similar to a name and not among others."""
    valid = re.sub(r'[^A-Za-z0-9_]', '_', name[:_LONGEST_NAME])
    if not _NAME.fullmatch(valid):
        valid = f'_{valid}'[:_LONGEST_NAME]
    number, candidate = 2, valid
    while candidate in others or candidate in RESERVED_NAMES:
        suffix = f'_{number}'
        number, candidate = number + 1, valid[: _LONGEST_NAME - len(suffix)] + suffix
    return candidate


def check_name(where: str, name: str, before: Collection[str]) -> None:
    """Raise ValueError for a name that no member of a group can have."""
    if len(name) > _LONGEST_NAME or not _NAME.fullmatch(name):
        allowed = f'at most {_LONGEST_NAME} letters a-z, digits and _, and no digit first'
    elif name in RESERVED_NAMES:
        allowed = 'other than that of a topic, a marker or a parameter that exists'
        if name == 'sphere':
            allowed += ', as sphere.radius'
    elif name in before:
        allowed = 'a name that is not used twice'
    else:
        return
    remedy = f'write {write(_valid_name(name, before))}'
    if where.endswith(']'):
        raise invalid_value_error(where, name, allowed, remedy)
    raise ValueError(f'{where} is {format_value(name)}, but must be {allowed}; {remedy}')
