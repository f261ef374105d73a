"""
Parameters of colliders: rigid bodies that move as commanded, unaffected by the cloth.

``collider.names`` lists the colliders of a scene, and ``collider.NAME.type`` and so on are the
parameters of each.  Parameters may be given for a name that is not listed, so that a collider can
be prepared one parameter after the other before it is added; they have no effect until then.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

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

MAX_COLLIDERS = 64
# Parameters of the shape that each type has; they must be given.
SHAPE_PARAMETERS: dict[str, tuple[str, ...]] = {
    'plane': (),
    'sphere': ('radius',),
    'box': ('size',),
    'capsule': ('radius', 'length'),
    'cylinder': ('radius', 'length'),
    'mesh': ('mesh',),
}
# Names whose topics, markers or parameters there are already.
RESERVED_NAMES = (
    *('sphere', 'sphere_pose', 'wind', 'particles', 'markers', 'diagnostics', 'names'),
    *('clock', 'tf', 'tf_static', 'rosout', 'parameter_events', parameter_file.NODE_NAME),
    *('sheet', 'pins', 'springs'),
)
_LEAST, _GREATEST = 1e-4, 1e3  # m, of lengths
_NAME = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
_LONGEST_NAME = 64
_MOST_ADVISED = 3  # names in an error about too many of them


@dataclass(frozen=True)
class ColliderParameters(ParameterGroup):
    """
    Parameters of one collider.

    Attributes
    ----------
    name
        Unique in the scene, a token of ROS names.
    type
        A key of `SHAPE_PARAMETERS`; empty while it is not given, which only a collider that is
        not in `collider.names` may be.
    size
        Lengths of the edges of a box, m.
    radius
        Of a sphere, capsule or cylinder, m.
    length
        Of a cylinder, or of the straight part of a capsule, along its z, m.
    mesh
        Path of a file.
    position, orientation
        Of the collider in the frame of the scene, or in `frame_id`: m, unit quaternion x y z w.
        Shapes are centred at the origin; a plane is z = 0, with the free side at positive z.
    friction
        Coefficient of Coulomb friction.
    frame_id
        Frame that the collider follows; empty: that of the scene.

    """

    name: str = ''
    type: str = parameter('', 'shape', choices=tuple(SHAPE_PARAMETERS))
    size: Vector = parameter(
        (0.0, 0.0, 0.0), 'edges of a box along its x, y, z', unit='m', low=0, high=_GREATEST
    )
    radius: float = parameter(
        0.0, 'radius of a sphere, capsule or cylinder', unit='m', low=0, high=_GREATEST
    )
    length: float = parameter(
        0.0,
        'height of a cylinder, or straight part of a capsule, along its z',
        unit='m',
        low=0,
        high=_GREATEST,
    )
    mesh: str = parameter('', 'path of an STL or OBJ file with a closed mesh')
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
    friction: float = parameter(0.3, 'coefficient of Coulomb friction', low=0, high=10)
    frame_id: str = parameter('', 'tf frame that it follows; empty: it does not')

    def full_name(self, field: str) -> str:
        """Return the dotted name of a field."""
        return f'{Colliders.prefix}{self.name}.{field}'

    def check(self) -> None:
        """Normalise the quaternion."""
        name = self.full_name('orientation')
        unit = unit_vector(name, self.orientation, 'quaternion', IDENTITY)
        object.__setattr__(self, 'orientation', unit)

    def check_complete(self) -> None:
        """Raise ValueError if something that the type needs is not given, or too small."""
        if not self.type:
            choices = ', '.join(repr(each) for each in SHAPE_PARAMETERS)
            raise ValueError(
                f'{self.full_name("type")} is not given, but must be one of {choices}; '
                f'write {write(next(iter(SHAPE_PARAMETERS)))}, and give it before or together '
                'with collider.names'
            )
        for field in SHAPE_PARAMETERS[self.type]:
            name, value = self.full_name(field), getattr(self, field)
            if isinstance(value, str):
                if not value.strip():
                    raise ValueError(
                        f'{name} is not given, but must be the path of an STL or OBJ file, for '
                        'a mesh; write "shape.stl", or the path of another file'
                    )
                continue
            lengths = value if isinstance(value, tuple) else (value,)
            if min(lengths) < _LEAST:
                usual = 0.1 if max(lengths) == 0 else _LEAST
                allowed = [max(each, usual) if each < _LEAST else each for each in lengths]
                raise invalid_value_error(
                    name,
                    list(value) if isinstance(value, tuple) else value,
                    f'{_LEAST:g} to {_GREATEST:g} m, for a {self.type}',
                    f'write {write(allowed if isinstance(value, tuple) else allowed[0])}',
                )

    @property
    def unused(self) -> tuple[str, ...]:
        """Names of parameters that are given and have no effect on a collider of this type."""
        used = SHAPE_PARAMETERS.get(self.type, ())
        fields = dict.fromkeys(each for some in SHAPE_PARAMETERS.values() for each in some)
        given = (
            field for field in fields if getattr(self, field) not in ('', 0.0, (0.0, 0.0, 0.0))
        )
        return tuple(self.full_name(field) for field in given if field not in used)


@dataclass(frozen=True)
class Colliders(ParameterGroup):
    """
    The colliders of a scene besides the sphere, and parameters of others that are not added yet.

    Attributes
    ----------
    names
        Of the colliders of the scene.
    members
        Parameters, in the order of `names`, and after these those of others by their names.

    """

    prefix: ClassVar[str] = 'collider.'
    member: ClassVar[type[ParameterGroup]] = ColliderParameters
    names: tuple[str, ...] = parameter((), 'names of colliders, besides the sphere')
    members: tuple[ColliderParameters, ...] = ()

    @staticmethod
    def converted(name: str, value: object, default: object, known: ParameterSpec) -> Any:
        """Return the names, of which too many are refused before each is looked at."""
        if isinstance(value, (list, tuple)) and len(value) > MAX_COLLIDERS:
            texts = [each for each in value[:MAX_COLLIDERS] if isinstance(each, str)]
            some = list(dict.fromkeys(map(_valid_name, texts)))[:_MOST_ADVISED]
            raise invalid_value_error(
                f'the length of {name}',
                len(value),
                f'at most {MAX_COLLIDERS}',
                f'write {write(some)}, or up to {MAX_COLLIDERS} names',
            )
        return convert(name, value, default, known)

    def check(self) -> None:
        """Check names and members; leave out empty names, and sort the members."""
        names = tuple(name for name in self.names if name.strip())
        object.__setattr__(self, 'names', names)
        for place, name in enumerate(names):
            _check_name(f'{self.prefix}names[{place}]', name, names[:place])
        given = {each.name: each for each in self.members}
        unnamed = sorted(set(given) - set(names))
        for name in unnamed:
            _check_name('the name of a collider', name, ())
        if len(names) + len(unnamed) > MAX_COLLIDERS:
            raise invalid_value_error(
                'the number of colliders',
                len(names) + len(unnamed),
                f'at most {MAX_COLLIDERS}, those with parameters alone included',
                f'write {self.prefix}names: {write(names[:_MOST_ADVISED])}, which removes the '
                'parameters of others',
            )
        members = [given.get(name, ColliderParameters(name=name)) for name in names]
        object.__setattr__(self, 'members', (*members, *(given[name] for name in unnamed)))
        for each in members:
            if each.name not in given and (near := _closest(each.name, unnamed)):
                right = [near if name == each.name else name for name in names]
                raise ValueError(
                    f'{each.full_name("type")} is not given, but that of {near!r} is; write '
                    f'{self.prefix}names: {write(right)}'
                )
            each.check_complete()

    @property
    def named(self) -> tuple[ColliderParameters, ...]:
        """The colliders of the scene, in the order of `names`."""
        return self.members[: len(self.names)]

    @property
    def unnamed(self) -> tuple[ColliderParameters, ...]:
        """Parameters of colliders that are not in `names`."""
        return self.members[len(self.names) :]

    def children(self) -> dict[str, Any]:
        """Return the names, and the parameters of each collider by its name."""
        return {'names': self.names, **{each.name: each for each in self.members}}

    def changed(self) -> dict[str, Any]:
        """Return the names, and of each collider what differs from the defaults, and its type."""
        names = super().changed()
        return names | {each.name: {'type': each.type, **each.changed()} for each in self.members}

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Any:
        """Build the group from a mapping, nested or with dotted names, or both."""
        children = grouped(values, cls.prefix, lambda _: True)
        names = children.pop('names', ())
        members = []
        for name, value in children.items():
            if isinstance(value, ColliderParameters) and value.name == name:
                members.append(value)
                continue
            if isinstance(value, ColliderParameters):
                value = value.children()
            elif not isinstance(value, Mapping):
                raise group_error(cls.prefix + name, value)
            prefix, fields = f'{cls.prefix}{name}.', {each.name for each in cls.member.fields()}
            known = grouped(value, prefix, fields.__contains__)
            members.append(ColliderParameters(name=name, **known))
        return cls(names=names, members=tuple(members))

    def without(self, names: Collection[str]) -> Colliders:
        """Return the group without the parameters of colliders, by their dotted names."""
        dropped = {name.removeprefix(self.prefix) for name in names}
        return self._keeping(lambda each: each.name not in dropped)

    def without_unnamed(self, given: Collection[str]) -> Colliders:
        """Return the group without unnamed colliders, but for the parameters of these names."""
        kept = {name.split('.')[1] for name in given if name.startswith(self.prefix)}
        named = set(self.names)
        return self._keeping(lambda each: each.name in named | kept)

    def _keeping(self, keep: Callable[[ColliderParameters], bool]) -> Colliders:
        members = tuple(each for each in self.members if keep(each))
        if len(members) == len(self.members):
            return self
        # Not checked: `names` may be incomplete until the parameters of a change are merged.
        result = object.__new__(Colliders)
        object.__setattr__(result, 'names', self.names)
        object.__setattr__(result, 'members', members)
        return result


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


def _check_name(where: str, name: str, before: Collection[str]) -> None:
    """Raise ValueError for a name that cannot be that of a collider."""
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
